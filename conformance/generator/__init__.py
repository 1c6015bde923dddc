"""The generator of the vectors; make.py is the command."""
