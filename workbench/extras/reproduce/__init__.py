"""The works behind this program done again, from a checkout."""
