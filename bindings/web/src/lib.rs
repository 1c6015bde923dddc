//! Web pages that play SplatStream. The player and the decoder are those of the npm packages, beside this crate in the
//! repository; a page holds them, so that it needs no other file and asks no other machine for anything.
//!
//! ```
//! let stream = b"the bytes of a stream";
//! let html = splatstream_web::page_with("A scene", stream);
//! assert!(html.contains("<title>A scene</title>"));
//! ```

mod link;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use link::{Module, link};
use std::io::Write;

const TEMPLATE: &str = include_str!("../page/page.html");
const WASM: &[u8] = include_bytes!("../decoder/splatstream.wasm");
/// The same with what plays packages.
const PACKAGES: &[u8] = include_bytes!("../decoder/splatstream-packages.wasm");

/// Lists modules by their paths from the root of this crate.
macro_rules! modules {
    ($($path:literal),+ $(,)?) => {
        &[$(Module { path: $path, source: include_str!(concat!("../", $path)) }),+]
    };
}

/// Everything that pages consist of, in any order.
const MODULES: &[Module<'static>] = modules![
    "decoder/bytes.js",
    "decoder/client.js",
    "decoder/decoder.js",
    "decoder/fetcher.js",
    "decoder/index.js",
    "decoder/worker.js",
    "page/start.js",
    "player/attributes.js",
    "player/context.js",
    "player/controls.js",
    "player/drops.js",
    "player/element.js",
    "player/framing.js",
    "player/icons.js",
    "player/index.js",
    "player/keys.js",
    "player/losses.js",
    "player/message.js",
    "player/panel.js",
    "player/playback.js",
    "player/renderer.js",
    "player/shaders.js",
    "player/side.js",
    "player/splitter.js",
    "player/stage.js",
    "player/style.js",
    "player/template.js",
    "player/texels.js",
    "player/timeline.js",
    "player/track.js",
    "player/vectors.js",
];

/// A page that plays a stream which it holds. It connects to nothing.
pub fn page_with(title: &str, stream: &[u8]) -> String {
    page(title, WASM, &STANDARD.encode(stream), "", "'none'")
}

/// A page that plays a stream of its own server, at an address relative to the page, while it is received.
pub fn page_beside(title: &str, url: &str) -> String {
    page(title, WASM, "", url, "'self'")
}

/// A page that plays a package of its own server: the manifest is at an address relative to the page.
pub fn page_of_package(title: &str, manifest: &str) -> String {
    page(title, PACKAGES, "", manifest, "'self'")
}

fn page(title: &str, module: &[u8], stream: &str, url: &str, connect: &str) -> String {
    let parts = [
        ("{connect}", connect),
        ("{title}", &escaped(title)),
        ("{module}", &STANDARD.encode(compressed(module))),
        ("{worker}", &link(MODULES, "decoder/worker.js")),
        ("{url}", &escaped(url)),
        ("{stream}", stream),
        ("{player}", &link(MODULES, "page/start.js")),
    ];
    let mut html = String::new();
    let mut rest = TEMPLATE;
    for (name, value) in parts {
        let (before, after) = rest.split_once(name).unwrap_or((rest, ""));
        html.push_str(before);
        html.push_str(value);
        rest = after;
    }
    html + rest
}

/// Text between tags or quotes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Bytes with zlib.
fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    // Writing to memory does not fail.
    encoder.write_all(bytes).and_then(|()| encoder.finish()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_everything() {
        let page = page_with("<&\">", &[1, 2, 3]);
        assert!(page.contains("<title>&lt;&amp;&quot;></title>") && page.contains(">AQID</script>"));
        for address in ["http:", "https:", "src=", "href=\"/"] {
            assert!(!page.contains(address), "{address}");
        }
        assert_eq!(page.matches("</script>").count(), 4);
        assert_eq!(page.matches("<script").count(), 4);
    }

    #[test]
    fn a_page_may_have_its_stream_beside_it() {
        let page = page_beside("", "stream.gss");
        assert!(page.contains("data-url=\"stream.gss\"></script>") && page.contains("connect-src 'self'"));
    }

    #[test]
    fn a_page_of_a_package_has_the_module_for_packages() {
        let (package, stream) = (page_of_package("", "manifest.json"), page_beside("", "manifest.json"));
        assert!(package.contains("data-url=\"manifest.json\"></script>"));
        assert!(package.len() > stream.len() + 50_000 && package.len() < 800_000, "{} bytes", package.len());
    }

    #[test]
    fn a_page_without_its_stream_is_small() {
        let page = page_with("", &[]);
        assert!(page.len() < 600_000, "{} bytes", page.len());
    }
}
