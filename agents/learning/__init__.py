"""Training of policies, and trained policies."""
