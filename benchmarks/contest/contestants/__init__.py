"""Contestants: programs that read the folder of a case and write an answer."""
