"""Classical controllers of the contact force."""
