//! SOG with codebooks and, in its first version, with ranges.

use splatstream_files::sog;

use super::samples::{LIMITS, meta, sog_with};

#[test]
fn codebooks_give_values_to_bytes() {
    let frame = sog::read_zip(&sog_with(&meta(), 252), &LIMITS).unwrap();
    assert_eq!((frame.len(), frame.sh_degree()), (4, 1));
    // Red of the pixels is 0, 60, 120, 180; entry `code` of the codebook is code / 64 − 2.
    assert_eq!(frame.log_scale()[0], [-2.0, -1.0625, -0.125, 0.8125]);
    assert_eq!(frame.dc()[0], frame.log_scale()[0]);
    // Entry 1 of the palette starts at pixel 3, whose red is 12 × 7; its green is 13 × 7.
    assert_eq!(frame.sh()[0][1], 84.0 / 64.0 - 2.0);
    assert_eq!(frame.sh()[1][1], 91.0 / 64.0 - 2.0);
    // Both bytes 0 is the low end, −1, of the log: −(e − 1).
    assert_eq!(frame.position()[0][0], -(1.0_f64.exp_m1()) as f32);
}

#[test]
fn version_1_has_ranges_and_a_logit_for_opacity() {
    let files = |name: &str| format!(r#""files":["{name}.webp"]"#);
    let meta = format!(
        r#"{{"means":{{"shape":[4,3],"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]}},
        "scales":{{"mins":[-5,-5,-5],"maxs":[0,0,0],{}}},"quats":{{{}}},
        "sh0":{{"mins":[-1,-1,-1,-8],"maxs":[1,1,1,8],{}}},
        "shN":{{"mins":-0.5,"maxs":0.5,"files":["centroids.webp","labels.webp"]}}}}"#,
        files("s"),
        files("q"),
        files("c")
    );
    let frame = sog::read_zip(&sog_with(&meta, 255), &LIMITS).unwrap();
    assert_eq!(frame.log_scale()[0][0], -5.0);
    assert_eq!(frame.opacity_logit()[0], (-8.0 + 16.0 * 200.0 / 255.0) as f32);
    assert_eq!(frame.sh()[0][0], -0.5);
    // Alpha 255 puts the component left out last.
    assert!(frame.rotation()[3].iter().all(|&z| z >= 0.0));
}
