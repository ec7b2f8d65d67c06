"""What a robot can know of itself and of the force at a contact, from what it observes."""
