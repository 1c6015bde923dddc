//! The header is what the sources say. `BLESS=1 cargo test -p splatstream-c --test header` writes it again.
#![allow(clippy::unwrap_used, reason = "a test")]

use std::path::Path;

/// The files of the interface, in the order of the header.
const SOURCES: [&str; 7] = ["version", "status", "settings", "planes", "cancel", "decoder", "slots"];

#[test]
fn the_header_is_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let header = root.join("include/splatstream.h");
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let builder = SOURCES.iter().fold(cbindgen::Builder::new().with_config(config), |builder, name| {
        builder.with_src(root.join(format!("src/{name}.rs")))
    });
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&header, &made).unwrap();
    }
    let kept = std::fs::read_to_string(&header).unwrap_or_default();
    let advice = "the interface changed: read the difference, then run with BLESS=1";
    assert!(kept == String::from_utf8(made).unwrap(), "{advice}");
}
