"""The robots that come with the package."""
