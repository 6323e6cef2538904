"""Arrays and a model in, a result out."""
