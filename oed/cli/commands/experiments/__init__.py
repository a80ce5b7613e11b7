"""Commands that plan experiments, and show them."""
