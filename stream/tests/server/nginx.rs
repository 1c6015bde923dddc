//! The same folder by nginx, with the configuration that this crate comes with.

use super::client::{Client, Reply, ask};
use super::{MACHINE, Running, folder};
use std::fs::{self, File};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{self, sleep};
use std::time::{Duration, SystemTime};

/// nginx in the foreground, which ends with the value.
struct Nginx {
    address: SocketAddr,
    process: Child,
}

impl Nginx {
    /// None where it is not installed.
    fn start(folder: &Path, work: &Path) -> Option<Self> {
        let program = ["nginx", "/usr/sbin/nginx"]
            .into_iter()
            .find(|program| Command::new(program).arg("-v").stderr(Stdio::null()).status().is_ok())?;
        let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let example = include_str!("../../nginx.conf");
        let settings = example
            .replace("127.0.0.1:8080", &address.to_string())
            .replace("/srv/splats", folder.to_str().unwrap());
        // Workers of a master that is root would be somebody else, who may not read the folder.
        let user = Command::new("id").arg("-un").output().unwrap().stdout;
        let user = String::from_utf8(user).unwrap();
        let line = if user.trim() == "root" { "user root;\n" } else { "" };
        fs::write(work.join("nginx.conf"), format!("{line}{settings}")).unwrap();
        let mut command = Command::new(program);
        command.arg("-p").arg(work).arg("-c").arg(work.join("nginx.conf"));
        let process = command.stderr(File::create(work.join("errors")).unwrap()).spawn().unwrap();
        let nginx = Self { address, process };
        for _ in 0..200 {
            if TcpStream::connect(address).is_ok() {
                return Some(nginx);
            }
            sleep(Duration::from_millis(50));
        }
        panic!("nginx does not start: {}", fs::read_to_string(work.join("errors")).unwrap());
    }
}

impl Drop for Nginx {
    fn drop(&mut self) {
        // Its workers end with it when it is asked to, not when it is killed.
        let _gone = Command::new("kill").arg(self.process.id().to_string()).status();
        let _ended = self.process.wait();
    }
}

/// What must agree; entity tags and the bodies of refusals need not.
fn essence(reply: &Reply) -> (u16, Vec<String>, &[u8]) {
    let names: &[&str] = match reply.status {
        200 | 206 => &[
            "content-type",
            "content-length",
            "content-range",
            "last-modified",
            "cache-control",
            "accept-ranges",
            "access-control-allow-origin",
            "access-control-expose-headers",
            "x-content-type-options",
        ],
        304 => &["last-modified", "access-control-allow-origin"],
        _ => &["content-range", "access-control-allow-origin"],
    };
    // nginx says that it takes ranges only where none was asked for.
    let names = names.iter().filter(|name| reply.status == 200 || **name != "accept-ranges");
    let headers = names.map(|name| format!("{name}: {}", reply.header(name))).collect();
    (reply.status, headers, if reply.status < 300 { &reply.body } else { &[] })
}

/// Targets, and headers a line each.
const REQUESTS: [(&str, &str); 20] = [
    ("/talk/s0.mp4", ""),
    ("/talk/s0.mp4", "Range: bytes=0-99"),
    ("/talk/s0.mp4", "Range: bytes=100000-899999"),
    ("/talk/s0.mp4", "Range: bytes=-5"),
    ("/talk/s0.mp4", "Range: bytes=999999-"),
    ("/talk/s0.mp4", "Range: bytes=1000000-"),
    ("/talk/s0.mp4", "Range: bytes=0-9\nIf-Range: MODIFIED"),
    ("/talk/s0.mp4", "Range: bytes=0-9\nIf-Range: \"other\""),
    ("/talk/s0.mp4", "If-Modified-Since: MODIFIED"),
    ("/talk/s0.mp4", "If-None-Match: \"other\""),
    ("/talk/s0.mp4", "If-Match: \"other\""),
    ("/talk/s0-1.m4s", ""),
    ("/talk/manifest.mpd", ""),
    ("/talk/manifest.json", ""),
    ("/talk.gss", ""),
    ("/", ""),
    ("/player.js", ""),
    ("/player.wasm", ""),
    ("/none.mp4", ""),
    ("/.hidden", ""),
];

#[test]
fn nginx_answers_the_same() {
    let (folder, work) = (folder(), tempfile::tempdir().unwrap());
    fs::write(folder.path().join(".hidden"), "secret").unwrap();
    let old = SystemTime::now() - Duration::from_secs(1000);
    for file in ["talk.gss", "index.html", "player.js", "player.wasm"] {
        File::options().write(true).open(folder.path().join(file)).unwrap().set_modified(old).unwrap();
    }
    let Some(nginx) = Nginx::start(folder.path(), work.path()) else {
        println!("skipped: nginx is not installed");
        return;
    };
    let server = Running::start(folder.path(), |_| ());
    let modified = ask(server.address, "HEAD", "/talk/s0.mp4", &[]).header("last-modified").to_owned();
    for (target, lines) in REQUESTS {
        let lines = lines.replace("MODIFIED", &modified);
        let headers: Vec<&str> = lines.lines().collect();
        for method in ["GET", "HEAD"] {
            let ours = ask(server.address, method, target, &headers);
            let theirs = ask(nginx.address, method, target, &headers);
            assert_eq!(essence(&ours), essence(&theirs), "{method} {target} {headers:?}");
        }
    }
    let tag = ask(nginx.address, "HEAD", "/talk/s0.mp4", &[]).header("etag").to_owned();
    let known = ask(nginx.address, "GET", "/talk/s0.mp4", &[&format!("If-None-Match: {tag}")]);
    assert_eq!(known.status, 304);
    let preflight = ["Origin: https://a", "Access-Control-Request-Method: GET"];
    let reply = ask(nginx.address, "OPTIONS", "/talk/s0.mp4", &preflight);
    assert_eq!(reply.header("access-control-allow-headers"), "range,if-range");
}

#[test]
fn nginx_serves_a_thousand_clients() {
    let _alone = MACHINE.lock();
    let (folder, work) = (folder(), tempfile::tempdir().unwrap());
    let Some(nginx) = Nginx::start(folder.path(), work.path()) else {
        println!("skipped: nginx is not installed");
        return;
    };
    let address = nginx.address;
    // A hundred threads with ten connections each, all open at once.
    let threads: Vec<_> = (0..100)
        .map(|_| {
            thread::spawn(move || {
                let mut clients: Vec<_> = (0..10).map(|_| Client::connect(address)).collect();
                for first in (0..10).map(|number| number * 90_000) {
                    let range = format!("Range: bytes={first}-{}", first + 9_999);
                    for client in &mut clients {
                        client.send("GET", "/talk/s0.mp4", &[&range]).unwrap();
                    }
                    for client in &mut clients {
                        let reply = client.receive("GET").unwrap();
                        assert!(reply.status == 206 && reply.body.len() == 10_000);
                    }
                }
            })
        })
        .collect();
    threads.into_iter().for_each(|thread| thread.join().unwrap());
}
