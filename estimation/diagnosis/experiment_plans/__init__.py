"""What a log could have shown, and what to measure next."""
