//! Requests that want more than the folder.

use super::client::{Client, get};
use super::{Running, folder};
use std::fs;

/// Targets that name something outside the folder, something hidden, or nothing.
const HOSTILE: [&str; 28] = [
    "/../secret.txt",
    "/talk/../../secret.txt",
    "/%2e%2e/secret.txt",
    "/%2E%2E/secret.txt",
    "/.%2e/secret.txt",
    "/..%2fsecret.txt",
    "/..%5csecret.txt",
    "/..\\secret.txt",
    "/talk/..%2f..%2fsecret.txt",
    "/%252e%252e/secret.txt",
    "/%c0%ae%c0%ae/secret.txt",
    "//etc/passwd",
    "///etc/passwd",
    "/%2fetc/passwd",
    "//%2fetc%2fpasswd",
    "/talk//s0.mp4",
    "/./talk.gss",
    "/talk/./s0.mp4",
    "/.hidden",
    "/.git/config",
    "/%2ehidden",
    "/visible",
    "/link.txt",
    "/linked/secret.txt",
    "/pipe",
    "/talk.gss%00.mp4",
    "/talk",
    "/talk/",
];

#[test]
#[cfg(unix)]
fn nothing_leaves_the_folder() {
    use std::os::unix::fs::symlink;
    let outer = tempfile::tempdir().unwrap();
    let served = outer.path().join("served");
    fs::rename(folder().keep(), &served).unwrap();
    fs::write(outer.path().join("secret.txt"), "secret").unwrap();
    fs::write(served.join(".hidden"), "secret").unwrap();
    fs::create_dir(served.join(".git")).unwrap();
    fs::write(served.join(".git/config"), "secret").unwrap();
    symlink(served.join(".hidden"), served.join("visible")).unwrap();
    symlink(outer.path().join("secret.txt"), served.join("link.txt")).unwrap();
    symlink(outer.path(), served.join("linked")).unwrap();
    symlink("/dev/zero", served.join("zero")).unwrap();
    symlink("talk.gss", served.join("inside.gss")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(served.join("pipe")).status();
    assert!(made.is_ok_and(|status| status.success()));
    let server = Running::start(&served, |_| ());
    for target in HOSTILE.into_iter().chain(["/zero"]) {
        let reply = get(server.address, target, &[]);
        assert!([400, 404].contains(&reply.status), "{target}: {}", reply.status);
        assert!(!reply.body.windows(6).any(|part| part == b"secret" || part == b"root:x"), "{target}");
    }
    assert_eq!(get(server.address, "/inside.gss", &[]).status, 200);
    assert_eq!(get(server.address, "/talk.gss?t=1", &[]).status, 200);
}

#[test]
fn what_is_not_http_is_refused() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    let requests: [&[u8]; 6] = [
        b"\0\0\0\0\0\0\0\0\r\n\r\n",
        b"GET talk.gss HTTP/1.1\r\nHost: a\r\n\r\n",
        b"GET / HTTP/9.9\r\nHost: a\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nBad Header: 1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        b"GET \xff\xfe HTTP/1.1\r\nHost: a\r\n\r\n",
    ];
    for request in requests {
        let mut client = Client::connect(server.address);
        client.write(request).unwrap();
        let status = client.head().map_or(400, |(reply, _)| reply.status);
        assert!([400, 404].contains(&status), "{}: {status}", request.escape_ascii());
    }
    // Afterwards it serves as before; a target with a host is one.
    assert_eq!(get(server.address, "http://localhost/talk.gss", &[]).status, 200);
}
