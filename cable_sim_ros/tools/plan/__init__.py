"""What a recovery or a tow needs of its winch."""
