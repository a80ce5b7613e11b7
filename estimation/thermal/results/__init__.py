"""What thermal fits found."""
