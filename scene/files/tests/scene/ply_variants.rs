//! PLY in all the ways that others write it.

use splatstream_files::{compressed_ply, ply};

use super::samples::{LIMITS, compressed_ply as packed, small_frame};

const NAMES: [&str; 14] = [
    "rot_3", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "f_dc_2", "f_dc_1",
    "f_dc_0", "z", "y", "x",
];

/// A header with one element before the vertices and one after, in an unusual order, with more than needed.
fn header(encoding: &str, scalar: &str, end: &str) -> String {
    let mut lines = vec![
        "ply".to_owned(),
        format!("format {encoding} 1.0"),
        "comment made by hand".to_owned(),
        "element camera 2".to_owned(),
        "property uchar id".to_owned(),
        "property list uchar short pixels".to_owned(),
        "element vertex 2".to_owned(),
        "property uchar class".to_owned(),
    ];
    lines.extend(NAMES.map(|name| format!("property {scalar} {name}")));
    lines.extend(["element face 0", "property list uchar int indices", "end_header"].map(str::to_owned));
    lines.iter().map(|line| format!("{line}{end}")).collect()
}

/// The value of each property of `row`: unlike all others, and a unit quaternion.
fn value(name: &str, row: u8) -> f64 {
    match name {
        "rot_0" => 1.0,
        "rot_1" | "rot_2" | "rot_3" => 0.0,
        name => name.bytes().map(f64::from).sum::<f64>() / 8.0 + f64::from(row),
    }
}

fn check(bytes: &[u8]) {
    let frame = ply::read(bytes, &LIMITS).unwrap();
    assert_eq!(frame.len(), 2);
    for row in 0..2_u8 {
        let at = usize::from(row);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            assert_eq!(f64::from(frame.position()[axis][at]), value(name, row));
            assert_eq!(f64::from(frame.log_scale()[axis][at]), value(&format!("scale_{axis}"), row));
            assert_eq!(f64::from(frame.dc()[axis][at]), value(&format!("f_dc_{axis}"), row));
        }
        assert_eq!(f64::from(frame.opacity_logit()[at]), value("opacity", row));
    }
}

#[test]
fn ascii_with_carriage_returns() {
    let mut text = header("ascii", "float", "\r\n");
    text.push_str("7 3 1 2 3\r\n8 0\r\n");
    for row in 0..2 {
        text.push_str("200 ");
        text.push_str(&NAMES.map(|name| value(name, row).to_string()).join(" "));
        text.push_str("\r\n");
    }
    check(text.as_bytes());
}

#[test]
fn doubles_in_either_byte_order() {
    for (encoding, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = header(encoding, "double", "\n").into_bytes();
        bytes.extend([7, 2, 0, 0, 0, 0, 8, 0]);
        for row in 0..2 {
            bytes.push(200);
            for name in NAMES {
                let value = value(name, row);
                bytes.extend(if big { value.to_be_bytes() } else { value.to_le_bytes() });
            }
        }
        check(&bytes);
    }
}

#[test]
fn rest_coefficients_come_channel_by_channel() {
    let frame = small_frame();
    let bytes = ply::write(&frame);
    let text = String::from_utf8_lossy(&bytes);
    let header_end = text.find("end_header\n").unwrap() + "end_header\n".len();
    // x y z, nx ny nz, f_dc 0 to 2: f_rest_1 is the second coefficient of red, which is plane 3.
    let at = header_end + 9 * 4 + 4;
    let row = (9 + 9 + 8) * 4;
    let found = f32::from_le_bytes(bytes[at + row..at + row + 4].try_into().unwrap());
    assert_eq!(found, frame.sh()[3][1]);
}

#[test]
fn packed_vertices_reach_both_ends_of_their_ranges() {
    let frame = compressed_ply::read(&packed(), &LIMITS).unwrap();
    assert_eq!(frame.position().each_ref().map(|plane| plane[0]), [-1.0, -2.0, -3.0]);
    assert_eq!(frame.position().each_ref().map(|plane| plane[1]), [1.0, 2.0, 3.0]);
    assert_eq!(frame.log_scale().each_ref().map(|plane| plane[1]), [-3.0, -2.0, -1.0]);
    assert!(frame.opacity_logit()[0] < -6.0 && frame.opacity_logit()[1] > 6.0);
    // The third component is the largest, so nearly 1.
    assert!(frame.rotation()[2][0] > 0.999);
    // f_rest_0 is the first coefficient of red; f_rest_3 the first of green, plane 1.
    assert_eq!((frame.sh()[0][0], frame.sh()[0][1]), (-4.0, 4.0));
    assert_eq!(frame.sh()[1][0], (3.5 / 256.0 - 0.5) * 8.0);
}
