"""How streams are made: writing of bits, models, sections, units, frames, networks, and whole streams by plan or at random."""
