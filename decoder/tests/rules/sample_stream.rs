//! The builder itself: what it makes of the sample is a stream.

use crate::crafted::expect::assert_decodes;
use crate::crafted::{crc32, sample};

// covers: SS-BS-007, SS-RU-005, SS-DG-001, SS-DG-002, SS-DG-003, SS-OP-001, SS-OP-003
#[test]
fn the_sample_decodes_to_the_planes_of_the_reference_at_every_refinement() {
    assert_decodes("sample", &sample::scene());
}

#[test]
fn the_check_sum_of_the_builder_is_that_of_4_6() {
    assert_eq!([crc32(b""), crc32(b"123456789"), crc32(&[0; 4])], [0, 0xCBF4_3926, 0x2144_DF1C]);
}
