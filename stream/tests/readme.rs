//! The code of the README is compiled, and runs where it needs no server.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use std::error::Error;
use std::fs::File;
use std::path::Path;

/// The first one: the files of a package.
fn packaged(path: &Path, directory: &Path) -> Result<(), Box<dyn Error>> {
    use splatstream_format::Limits;
    use splatstream_stream::package::{Options, Package};

    let stream = std::fs::read(path)?;
    // README 1
    let package = Package::of(&stream, &Options::default(), &Limits::default())?;
    for name in package.files() {
        package.write(name, &mut File::create(directory.join(name))?)?;
    }
    // end
    Ok(())
}

/// The second one: the first decision of a player.
fn controlled() {
    // README 2
    use splatstream_stream::control::{Decision, Layered, Session, Settings};
    use splatstream_stream::simulation::ladders;

    let mut session = Session::new(ladders::small(60), Settings::default(), Layered::default(), 0);
    if let Decision::Fetch(fetch) = session.decide(0) {
        // Request these ranges of GOP 0, and say what arrives: session.received(now_us, bytes).
        assert!(fetch.bytes() > 0);
    }
    // end
}

/// The third one: a client, for which there is no server here.
#[cfg(feature = "client")]
#[expect(dead_code, unused_variables, reason = "it is compiled, which is enough")]
fn played() -> Result<(), Box<dyn Error>> {
    // README 3
    use splatstream_stream::client::{Client, Options, PlayedGop};
    use splatstream_stream::control::Layered;

    let mut client = Client::open("https://example.com/talk/", Options::default())?;
    let outcome = client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
        // Decode gop.head and gop.units at gop.point.
    })?;
    // end
    Ok(())
}

#[test]
fn the_code_of_the_readme_is_what_is_compiled_here() {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let readme: Vec<&str> = include_str!("../README.md").split("```rust\n").skip(1).collect();
    let here = include_str!("readme.rs");
    assert_eq!(readme.len(), 3);
    for (number, rest) in readme.into_iter().enumerate() {
        let block = rest.split("```").next().unwrap();
        let compiled = here.split(&format!("    // README {}\n", number + 1)).nth(1).unwrap();
        assert_eq!(words(block), words(compiled.split("    // end\n").next().unwrap()));
    }
}

#[test]
fn the_code_that_needs_no_server_runs() {
    let directory = tempfile::tempdir().unwrap();
    let stream = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/talk.gss");
    packaged(&stream, directory.path()).unwrap();
    let names = std::fs::read_dir(directory.path()).unwrap().count();
    assert!(names > 2, "{names} files");
    controlled();
}
