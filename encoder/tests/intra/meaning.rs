//! What the values mean: a PLY file becomes a stream and a PLY file again, property by property.

use crate::common::{encoded, strict};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Settings, Steps, Tools};
use splatstream_files::{ReadLimits, ply};
use splatstream_gaussians::GaussianFrame;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

const GAUSSIANS: usize = 24;

/// One Gaussian by PLY's names.
type Row = BTreeMap<String, f32>;

/// Values of which no two are alike, so that no exchange goes unseen.
fn source(sh_values: usize) -> Vec<Row> {
    let row = |i: usize| {
        let place = i as f32;
        let wave = |k: usize| ((i * 7 + k * 13) % 17) as f32 / 17.0 - 0.5;
        let mut row = Row::new();
        let mut set = |name: String, value: f32| assert!(row.insert(name, value).is_none());
        for (axis, value) in [("x", place), ("y", 30.0 - 0.5 * place), ("z", 7.0 + 0.25 * place)] {
            set(axis.to_owned(), value);
        }
        for channel in 0..3 {
            set(format!("f_dc_{channel}"), wave(channel) + channel as f32);
        }
        for k in 0..sh_values {
            set(format!("f_rest_{k}"), wave(k + 3) + 0.2 * k as f32);
        }
        set("opacity".to_owned(), 3.0 * wave(50));
        for axis in 0..3 {
            set(format!("scale_{axis}"), -4.0 + 1.5 * ((i + axis) % 3) as f32 + 0.3 * wave(60 + axis));
        }
        let turn = [1.0, wave(70), 2.0 * wave(71), wave(72)];
        let norm = turn.iter().map(|part| part * part).sum::<f32>().sqrt();
        (0..4).for_each(|part| set(format!("rot_{part}"), turn[part] / norm));
        row
    };
    (0..GAUSSIANS).map(row).collect()
}

fn ply_of(rows: &[Row]) -> Vec<u8> {
    let names: Vec<&String> = rows[0].keys().collect();
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", rows.len());
    names.iter().for_each(|name| text.push_str(&format!("property float {name}\n")));
    text.push_str("end_header\n");
    for row in rows {
        let values: Vec<String> = names.iter().map(|name| row[*name].to_string()).collect();
        text.push_str(&values.join(" "));
        text.push('\n');
    }
    text.into_bytes()
}

/// The rows of a binary little-endian PLY file of floats.
fn rows_of(ply: &[u8]) -> Vec<Row> {
    let end = b"end_header\n";
    let body = ply.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    let header = std::str::from_utf8(&ply[..body]).unwrap();
    let names: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property float ")).collect();
    let values: Vec<f32> =
        ply[body..].chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    let row =
        |values: &[f32]| names.iter().map(|name| (*name).to_owned()).zip(values.iter().copied()).collect();
    values.chunks_exact(names.len()).map(row).collect()
}

/// Encoded and decoded without visible loss; the rows in the order of x, as in the source.
fn through_a_stream(rows: &[Row]) -> (GaussianFrame, Vec<Row>) {
    let frame = ply::read(&ply_of(rows), &ReadLimits::default()).unwrap();
    let settings = Settings {
        steps: Steps {
            position_bits: 15.0,
            log_scale: 0.05,
            rotation: 0.009,
            opacity: 0.05,
            dc: 0.03,
            sh: 0.03,
        },
        tools: Tools::default(),
        keep_invisible: true,
        ..Settings::default()
    };
    let (bytes, _) = encoded(vec![frame], &settings);
    let mut output = None;
    let summary = decode_stream(&bytes, &strict(), |sequence, frame| {
        output = Some(to_gaussians(frame.planes, sequence).unwrap());
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
    let output = output.unwrap();
    let mut decoded = rows_of(&ply::write(&output));
    decoded.sort_by(|a, b| a["x"].total_cmp(&b["x"]));
    assert_eq!(decoded.len(), rows.len());
    (output, decoded)
}

/// The matrix of 7.10: three columns, one an axis.
fn columns(row: &Row) -> [[f32; 3]; 3] {
    let [w, x, y, z] = [0, 1, 2, 3].map(|part| row[&format!("rot_{part}")]);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Sum over the axes of variance times axis times axis, of trace 1.
fn covariance(row: &Row) -> [[f32; 3]; 3] {
    let columns = columns(row);
    let variance = [0, 1, 2].map(|axis| (2.0 * row[&format!("scale_{axis}")]).exp());
    let trace: f32 = variance.iter().sum();
    let entry =
        |i: usize, j: usize| (0..3).map(|a| variance[a] * columns[a][i] * columns[a][j]).sum::<f32>() / trace;
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)))
}

/// Y_c of 7.10.
fn harmonics([x, y, z]: [f32; 3]) -> [f32; 15] {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        -0.488_602_5 * y,
        0.488_602_5 * z,
        -0.488_602_5 * x,
        1.092_548_4 * x * y,
        -1.092_548_4 * y * z,
        0.315_391_57 * (2.0 * zz - xx - yy),
        -1.092_548_4 * x * z,
        0.546_274_2 * (xx - yy),
        -0.590_043_6 * y * (3.0 * xx - yy),
        2.890_611_4 * x * y * z,
        -0.457_045_8 * y * (4.0 * zz - xx - yy),
        0.373_176_34 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.457_045_8 * x * (4.0 * zz - xx - yy),
        1.445_305_7 * z * (xx - yy),
        -0.590_043_6 * x * (xx - 3.0 * yy),
    ]
}

// covers: SS-OUT-004, SS-DG-001
#[test]
fn every_property_of_a_ply_file_comes_back_under_its_name() {
    for sh_values in [0, 9, 24, 45] {
        let rows = source(sh_values);
        let (output, decoded) = through_a_stream(&rows);
        for (before, after) in rows.iter().zip(&decoded) {
            let close = |name: &str, bound: f32| {
                let (before, after) = (before[name], after[name]);
                assert!(
                    (before - after).abs() < bound,
                    "{name}: {before} became {after}, {sh_values} sh values"
                );
            };
            ["x", "y", "z"].iter().for_each(|name| close(name, 0.001));
            close("opacity", 0.051);
            (0..3).for_each(|channel| close(&format!("f_dc_{channel}"), 0.03));
            // Half a step in each of up to 45 components; neighbours differ by 0.2.
            (0..sh_values).for_each(|k| close(&format!("f_rest_{k}"), 0.09));
            for (before, after) in covariance(before).iter().flatten().zip(covariance(after).iter().flatten())
            {
                assert!((before - after).abs() < 0.05, "{before} became {after}");
            }
        }
        // Plane 3c + h of the output is f_rest_(h * S/3 + c).
        let by_x = |i: usize| decoded.iter().position(|row| row["x"] == output.position()[0][i]).unwrap();
        for i in 0..output.len() {
            for (plane, values) in output.sh().iter().enumerate() {
                let (c, h) = (plane / 3, plane % 3);
                assert_eq!(values[i], decoded[by_x(i)][&format!("f_rest_{}", h * sh_values / 3 + c)]);
            }
        }
    }
}

// covers: SS-OUT-004
#[test]
fn a_gaussian_has_the_same_colour_from_every_side() {
    let sh_values = 45;
    let rows = source(sh_values);
    let (output, decoded) = through_a_stream(&rows);
    for i in 0..output.len() {
        let row = decoded.iter().position(|row| row["x"] == output.position()[0][i]).unwrap();
        for direction in
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, -0.64, 0.48], [-0.48, 0.6, -0.64]]
        {
            let y = harmonics(direction);
            for h in 0..3 {
                let rest = |c: usize| y[c] * rows[row][&format!("f_rest_{}", h * 15 + c)];
                let source =
                    0.5 + 0.282_094_8 * rows[row][&format!("f_dc_{h}")] + (0..15).map(rest).sum::<f32>();
                let sum = (0..15).map(|c| y[c] * output.sh()[3 * c + h][i]).sum::<f32>();
                let shown = 0.5 + 0.282_094_8 * output.dc()[h][i] + sum;
                assert!((source - shown).abs() < 0.12, "{direction:?}: {source} is shown as {shown}");
            }
        }
    }
}

#[test]
fn harmonics_are_orthonormal_on_the_sphere() {
    // A grid whose weights integrate these polynomials well enough.
    let (rings, sides) = (60, 120);
    let mut products = [[0.0_f64; 15]; 15];
    for ring in 0..rings {
        let z = (ring as f32 + 0.5) / rings as f32 * 2.0 - 1.0;
        let radius = (1.0 - z * z).sqrt();
        for side in 0..sides {
            let angle = side as f32 / sides as f32 * std::f32::consts::TAU;
            let y = harmonics([radius * angle.cos(), radius * angle.sin(), z]);
            for (a, row) in products.iter_mut().enumerate() {
                row.iter_mut().enumerate().for_each(|(b, product)| *product += f64::from(y[a] * y[b]));
            }
        }
    }
    let area = 4.0 * std::f64::consts::PI / f64::from(rings * sides);
    for (a, row) in products.iter().enumerate() {
        for (b, product) in row.iter().enumerate() {
            let expected = if a == b { 1.0 } else { 0.0 };
            assert!((product * area - expected).abs() < 0.01, "{a}, {b}: {}", product * area);
        }
    }
}
