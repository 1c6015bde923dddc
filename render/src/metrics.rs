//! How far apart two pictures are.
