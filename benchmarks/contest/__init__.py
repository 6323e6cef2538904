"""The public benchmark: logs whose friction is known, methods that find it, and one table of how well."""
