"""The verbs of the training half, one a file. They parse and call."""
