"""Forward dynamics with contacts, by MuJoCo."""
