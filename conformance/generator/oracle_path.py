"""Makes the modules of the oracle importable: the generator lets it say what is right."""

import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
CONFORMANCE = os.path.dirname(HERE)

sys.path.insert(0, os.path.join(CONFORMANCE, "oracle"))
