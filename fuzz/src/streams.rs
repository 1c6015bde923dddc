//! Small valid streams, the seeds of `units`, for `decode` to edit. Committed as they were encoded once: what an
//! edit means does not depend on the encoder.

/// Each uses other parts of the syntax.
pub const ALL: [&[u8]; 11] = [
    include_bytes!("../seeds/units/plain.bin"),
    include_bytes!("../seeds/units/groups.bin"),
    include_bytes!("../seeds/units/coefficients.bin"),
    include_bytes!("../seeds/units/vectors.bin"),
    include_bytes!("../seeds/units/blocks.bin"),
    include_bytes!("../seeds/units/contexts.bin"),
    include_bytes!("../seeds/units/predicted.bin"),
    include_bytes!("../seeds/units/layers.bin"),
    include_bytes!("../seeds/units/anchors.bin"),
    include_bytes!("../seeds/units/residual-vectors.bin"),
    include_bytes!("../seeds/units/learned.bin"),
];
