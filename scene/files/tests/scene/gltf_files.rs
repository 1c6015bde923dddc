//! glTF: both containers, nodes, several primitives, SPZ inside, and what is refused.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use splatstream_files::{Note, ReadLimits, gltf, read_scene, read_scene_as_is, spz, srgb};
use splatstream_gaussians::GaussianFrame;
use std::fs;

use super::samples::{LIMITS, small_frame};

/// The JSON and the binary chunk of a `.glb`.
fn split(glb: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let json = word(12);
    let binary = &glb[20 + json + 8..];
    assert_eq!((word(8), word(20 + json)), (glb.len(), binary.len()));
    (serde_json::from_slice(&glb[20..20 + json]).unwrap(), binary.to_vec())
}

/// A `.glb` of a document and its buffer.
fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = (28 + json.len() + binary.len()) as u32;
    let head =
        [*b"glTF", 2_u32.to_le_bytes(), length.to_le_bytes(), (json.len() as u32).to_le_bytes(), *b"JSON"];
    [head.as_flattened(), &json, &(binary.len() as u32).to_le_bytes(), b"BIN\0", binary].concat()
}

/// As JSON alone, the buffer inside of it.
pub(crate) fn with_data_uri(frame: &GaussianFrame) -> Vec<u8> {
    let (mut document, binary) = split(&gltf::write(frame).unwrap());
    document["buffers"][0]["uri"] =
        format!("data:application/octet-stream;base64,{}", STANDARD.encode(binary)).into();
    document.to_string().into_bytes()
}

fn frame() -> GaussianFrame {
    gltf::read(&gltf::write(&small_frame()).unwrap(), &LIMITS).unwrap()
}

/// What reading a changed file says.
fn refused(change: impl Fn(&mut Value)) -> String {
    let (mut document, binary) = split(&gltf::write(&small_frame()).unwrap());
    change(&mut document);
    gltf::read(&glb(&document, &binary), &LIMITS).unwrap_err().to_string()
}

/// The largest difference of values of two frames.
fn difference(a: &GaussianFrame, b: &GaussianFrame) -> f32 {
    let values = |frame: &GaussianFrame| frame.planes().iter().flatten().copied().collect::<Vec<f32>>();
    let pairs = values(a).into_iter().zip(values(b));
    assert_eq!((a.len(), a.sh_degree()), (b.len(), b.sh_degree()));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn both_containers_hold_the_same() {
    assert!(difference(&frame(), &small_frame().with_unit_rotations()) < 1e-6);
    assert_eq!(gltf::read(&with_data_uri(&small_frame()), &LIMITS).unwrap(), frame());
    let directory = tempfile::tempdir().unwrap();
    let (mut document, binary) = split(&gltf::write(&small_frame()).unwrap());
    document["buffers"][0]["uri"] = "parts/all%20of%20it.bin".into();
    fs::create_dir(directory.path().join("parts")).unwrap();
    fs::write(directory.path().join("parts/all of it.bin"), binary).unwrap();
    let path = directory.path().join("scene.gltf");
    fs::write(&path, document.to_string()).unwrap();
    assert_eq!(read_scene(&path, &LIMITS).unwrap(), frame());
    let error = gltf::read(document.to_string().as_bytes(), &LIMITS).unwrap_err().to_string();
    assert!(error.contains("a buffer outside of it, \"parts/all of it.bin\""), "{error}");
    for name in ["../all.bin", "/etc/passwd", "parts/../../x"] {
        document["buffers"][0]["uri"] = name.into();
        fs::write(&path, document.to_string()).unwrap();
        let error = read_scene(&path, &LIMITS).unwrap_err().to_string();
        assert!(
            error.contains("scene.gltf: the file names a buffer") && error.contains("not beside it"),
            "{error}"
        );
    }
}

#[test]
fn nodes_place_gaussians_and_primitives_are_joined() {
    let (mut document, binary) = split(&gltf::write(&small_frame()).unwrap());
    let primitive = document["meshes"][0]["primitives"][0].clone();
    let mut without_sh = primitive.clone();
    without_sh["attributes"].as_object_mut().unwrap().retain(|name, _| !name.contains("DEGREE_1"));
    let triangles = json!({ "attributes": {}, "mode": 4 });
    document["meshes"][0]["primitives"] = json!([primitive, triangles, without_sh]);
    // A quarter of a turn about y, twice as large, moved; then moved by the parent.
    let half = 0.5_f64.sqrt();
    document["nodes"] = json!([
        { "translation": [0, 0, 10], "children": [1] },
        { "mesh": 0, "rotation": [0, half, 0, half], "scale": [2, 2, 2], "translation": [1, 0, 0] },
    ]);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.glb");
    fs::write(&path, glb(&document, &binary)).unwrap();
    let scene = read_scene_as_is(&path, &LIMITS).unwrap();
    assert_eq!(scene.notes, [Note::OtherPrimitives { count: 1 }]);
    let (placed, plain) = (scene.frame, frame());
    assert_eq!((placed.len(), placed.sh_degree()), (6, 1));
    for row in 0..3 {
        let at = |frame: &GaussianFrame, row: usize| frame.position().each_ref().map(|plane| plane[row]);
        let [x, y, z] = at(&plain, row);
        // In glTF's axes, left, up, forward: x becomes -z and z becomes x.
        let (left, up, forward) = (-x, -y, z);
        let (left, up, forward) = (2.0 * forward + 1.0, 2.0 * up, -2.0 * left + 10.0);
        for other in [row, row + 3] {
            for (found, expected) in at(&placed, other).into_iter().zip([-left, -up, forward]) {
                assert!((found - expected).abs() < 1e-5, "{found} {expected}");
            }
            let larger = placed.log_scale()[0][other] - plain.log_scale()[0][row];
            assert!((larger - std::f32::consts::LN_2).abs() < 1e-6);
        }
        assert!(placed.sh().iter().all(|plane| plane[row + 3] == 0.0));
    }
    // Band 1 turns as its axes do: y keeps its coefficient.
    assert!((placed.sh()[0][1] - plain.sh()[0][1]).abs() < 1e-6);
}

#[test]
fn an_spz_file_inside_is_read() {
    let packed = spz::write(&small_frame()).unwrap();
    let mut binary = packed.clone();
    binary.resize(packed.len().next_multiple_of(4), 0);
    for name in ["KHR_gaussian_splatting_compression_spz_2", "KHR_gaussian_splatting_compression_spz"] {
        let document = json!({
            "asset": { "version": "2.0" }, "extensionsRequired": ["KHR_gaussian_splatting", name],
            "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 0, "extensions": {
                "KHR_gaussian_splatting": { "extensions": { name: { "bufferView": 0 } } } } }] }],
            "accessors": [{ "componentType": 5126, "count": 3, "type": "VEC3" }],
            "bufferViews": [{ "buffer": 0, "byteLength": packed.len() }],
            "buffers": [{ "byteLength": binary.len() }],
        });
        let frame = gltf::read(&glb(&document, &binary), &LIMITS).unwrap();
        assert_eq!(frame, spz::read(&packed, &LIMITS).unwrap());
    }
}

#[test]
fn normalised_integers_are_read() {
    let (mut document, mut binary) = split(&gltf::write(&small_frame()).unwrap());
    let index = document["meshes"][0]["primitives"][0]["attributes"]["KHR_gaussian_splatting:OPACITY"]
        .as_u64()
        .unwrap();
    let view = document["bufferViews"].as_array().unwrap().len();
    document["bufferViews"].as_array_mut().unwrap().push(json!({
        "buffer": 0, "byteOffset": binary.len(), "byteLength": 9, "byteStride": 4
    }));
    document["accessors"][index as usize] = json!({ "bufferView": view, "componentType": 5121, "normalized": true, "count": 3, "type": "SCALAR" });
    binary.extend([0, 9, 9, 9, 255, 9, 9, 9, 51, 0, 0, 0]);
    document["buffers"][0]["byteLength"] = binary.len().into();
    let frame = gltf::read(&glb(&document, &binary), &LIMITS).unwrap();
    let opacity = |row: usize| 1.0 / (1.0 + libm::exp(-f64::from(frame.opacity_logit()[row])));
    assert!((opacity(0) - 0.5 / 255.0).abs() < 1e-6 && (opacity(1) - 254.5 / 255.0).abs() < 1e-6);
    assert!((opacity(2) - 0.2).abs() < 1e-6);
}

#[test]
fn what_is_not_understood_is_named() {
    let said = [
        (refused(|json| json["asset"]["version"] = "1.0".into()), "glTF of version \"1.0\""),
        (
            refused(|json| json["nodes"][0]["scale"] = json!([-1, 1, 1])),
            "node 0 is mirrored, sheared or flattened",
        ),
        (refused(|json| json["nodes"][0]["children"] = json!([0])), "node 0 comes twice"),
        (refused(|json| json["nodes"][0]["mesh"] = 7.into()), "there is no mesh 7"),
        (
            refused(|json| {
                drop(json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("extensions"))
            }),
            "no primitive with KHR_gaussian_splatting",
        ),
        (
            refused(|json| {
                let attributes = json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
                attributes.retain(|name, _| !name.contains("SCALE") && name != "POSITION");
            }),
            "primitive 0 of mesh 0 lacks POSITION, KHR_gaussian_splatting:SCALE",
        ),
        (
            refused(|json| {
                let attributes = json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
                attributes.retain(|name, _| !name.ends_with("DEGREE_1_COEF_2"));
            }),
            "SH degree 1 lacks KHR_gaussian_splatting:SH_DEGREE_1_COEF_2",
        ),
        (
            refused(|json| {
                json["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["kernel"] =
                    "box".into();
            }),
            "the kernel \"box\"",
        ),
        (
            refused(|json| {
                json["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["colorSpace"] =
                    "lin_rec2020_display".into();
            }),
            "colours of the space \"lin_rec2020_display\"",
        ),
        (refused(|json| json["accessors"][0]["count"] = 4.into()), "needs 48 bytes, its buffer view has 36"),
        (refused(|json| json["accessors"][0]["type"] = "VEC2".into()), "is a VEC2, VEC3 is needed"),
        (refused(|json| json["bufferViews"][0]["byteOffset"] = 1e12.into()), "glTF: "),
        (
            refused(|json| json["extensionsRequired"] = json!(["KHR_gaussian_splatting_compression_x"])),
            "needs the extension KHR_gaussian_splatting_compression_x",
        ),
        (
            refused(|json| json["extensionsRequired"] = json!(["EXT_meshopt_compression"])),
            "needs the extension EXT_meshopt_compression",
        ),
    ];
    for (said, expected) in said {
        assert!(said.contains(expected), "{expected} is not in: {said}");
    }
}

#[test]
fn colours_in_linear_light_are_encoded_and_noted() {
    let (mut document, binary) = split(&gltf::write(&small_frame()).unwrap());
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.glb");
    let mut read_as = |space: &str| {
        document["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["colorSpace"] =
            space.into();
        fs::write(&path, glb(&document, &binary)).unwrap();
        read_scene_as_is(&path, &LIMITS).unwrap()
    };
    for space in ["srgb_rec709_display", "BT.709-sRGB"] {
        let scene = read_as(space);
        assert_eq!((scene.frame, scene.notes), (frame(), vec![]), "{space}");
    }
    for space in ["lin_rec709_display", "BT.709-linear"] {
        let scene = read_as(space);
        assert_eq!(scene.notes, [Note::LinearColours], "{space}");
        assert_eq!(scene.frame, srgb::from_linear(frame()));
        assert_ne!(scene.frame.dc(), frame().dc());
        assert_eq!(scene.frame.position(), frame().position());
    }
}

#[test]
fn many_nodes_that_show_one_mesh_are_counted() {
    let (mut document, binary) = split(&gltf::write(&small_frame()).unwrap());
    let nodes = vec![json!({ "mesh": 0 }); 2000];
    document["scenes"][0]["nodes"] = (0..nodes.len()).collect::<Vec<_>>().into();
    document["nodes"] = nodes.into();
    let file = glb(&document, &binary);
    assert_eq!(gltf::read(&file, &ReadLimits { max_memory: 1 << 24 }).unwrap().len(), 6000);
    let error = gltf::read(&file, &ReadLimits { max_memory: 1 << 20 }).unwrap_err().to_string();
    assert!(error.contains("max_memory"), "{error}");
}
