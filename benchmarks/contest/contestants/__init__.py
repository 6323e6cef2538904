"""Programs that take the folder of a case and write their answer: the methods that are compared."""
