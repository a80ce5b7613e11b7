"""What the checks of a log measure on it: numbers without a judgement."""
