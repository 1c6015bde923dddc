//! The code of the README is compiled: it is that of [`frames`].

/// What stands in the README, and is compiled here.
#[expect(clippy::print_stdout, reason = "the example prints")]
fn frames() -> splatstream::Result<()> {
    for frame in splatstream::Decoder::open("talk.gss")? {
        let frame = frame?; // index, operating point, gaussians(), warnings()
        println!("frame {}: {} Gaussians", frame.index(), frame.gaussians().len());
    }
    // Bytes from a network: decoder.push(&chunk)?; while let Some(frame) = decoder.next_frame()? { ... }
    Ok(())
}

/// The text between two marks, its spaces made one.
fn between(text: &str, start: &str, end: &str) -> String {
    let inside = text.split(start).nth(1).and_then(|rest| rest.split(end).next()).unwrap();
    inside.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_code_of_the_readme_is_what_is_compiled_here() {
    let readme = between(include_str!("../../README.md"), "```rust", "```");
    assert_eq!(readme, between(include_str!("readme.rs"), "splatstream::Result<()> {", "Ok(())"));
    // There is no such file here: it compiles, which is enough.
    assert!(matches!(frames(), Err(splatstream::Error::Io(_))));
}
