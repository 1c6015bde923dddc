"""The independent decoder of SplatStream streams: slow, and written from the text alone."""
