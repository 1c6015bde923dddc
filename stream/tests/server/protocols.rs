//! HTTP/2, and TLS. The certificate is of these tests alone.

use super::{Running, bytes, folder};
use splatstream_stream::server::{Server, ServerError, Settings, Tls};
use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

fn tls() -> Tls {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/server");
    Tls { certificates: here.join("localhost.crt"), key: here.join("localhost.key") }
}

fn wait<T>(work: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(work)
}

async fn connect(address: SocketAddr, protocol: &str) -> TlsStream<TcpStream> {
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(tls().certificates).unwrap()).unwrap();
    let mut config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    config.alpn_protocols = vec![protocol.as_bytes().to_vec()];
    let socket = TcpStream::connect(address).await.unwrap();
    let name = ServerName::try_from("localhost").unwrap();
    TlsConnector::from(Arc::new(config)).connect(name, socket).await.unwrap()
}

/// Asks for ten ranges at once.
async fn ask_in_parallel(socket: impl AsyncRead + AsyncWrite + Unpin + Send + 'static) {
    // The answers are read one after the other: there has to be room for all.
    let mut client = h2::client::Builder::new();
    client.initial_window_size(1 << 20).initial_connection_window_size(4 << 20);
    let (mut sender, connection) = client.handshake::<_, hyper::body::Bytes>(socket).await.unwrap();
    tokio::spawn(connection);
    let mut answers = Vec::new();
    for number in 0..10 {
        let request = hyper::Request::get("http://localhost/talk/s0.mp4")
            .header("range", format!("bytes={}-{}", number * 1_000, number * 1_000 + 99_999))
            .body(())
            .unwrap();
        sender = sender.ready().await.unwrap();
        answers.push(sender.send_request(request, true).unwrap().0);
    }
    let whole = bytes(1_000_000);
    for (number, answer) in answers.into_iter().enumerate() {
        let answer = answer.await.unwrap();
        assert_eq!(answer.status(), 206);
        let (mut body, mut arrived) = (answer.into_body(), Vec::new());
        while let Some(bytes) = body.data().await {
            let bytes = bytes.unwrap();
            body.flow_control().release_capacity(bytes.len()).unwrap();
            arrived.extend_from_slice(&bytes);
        }
        assert!(arrived == whole[number * 1_000..number * 1_000 + 100_000]);
    }
}

#[test]
fn http_2_needs_no_upgrade() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    wait(async { ask_in_parallel(TcpStream::connect(server.address).await.unwrap()).await });
    let (statistics, entries) = server.stop();
    assert_eq!((statistics.connections, statistics.successful), (1, 10));
    assert!(entries.iter().all(|entry| entry.protocol == "HTTP/2.0" && entry.target == "/talk/s0.mp4"));
}

/// Asks for the page so many times over one connection whose client takes no bytes of bodies. Gives the statuses; the connection
/// ends with the runtime.
async fn ask_and_take_nothing(address: SocketAddr, times: usize) -> Vec<u16> {
    let mut client = h2::client::Builder::new();
    client.initial_window_size(0);
    let socket = TcpStream::connect(address).await.unwrap();
    let (mut sender, connection) = client.handshake::<_, hyper::body::Bytes>(socket).await.unwrap();
    tokio::spawn(connection);
    let mut bodies = Vec::new();
    let mut statuses = Vec::new();
    for _ in 0..times {
        sender = sender.ready().await.unwrap();
        let request = hyper::Request::get("http://localhost/").body(()).unwrap();
        let answer = sender.send_request(request, true).unwrap().0.await.unwrap();
        statuses.push(answer.status().as_u16());
        bodies.push(answer);
    }
    statuses
}

#[test]
fn a_page_that_nobody_takes_is_in_flight() {
    let folder = folder();
    let page = "x".repeat(1 << 20);
    let server = Running::start(folder.path(), |settings| {
        settings.page = Some(page.clone());
        settings.limits.requests = 2;
    });
    assert_eq!(wait(ask_and_take_nothing(server.address, 4)), [200, 200, 503, 503]);
    // They end with the connection.
    let begun = std::time::Instant::now();
    let mut reply = super::client::get(server.address, "/", &[]);
    while reply.status == 503 && begun.elapsed().as_secs() < 10 {
        std::thread::sleep(std::time::Duration::from_millis(20));
        reply = super::client::get(server.address, "/", &[]);
    }
    assert!(reply.status == 200 && reply.body == page.as_bytes());
    assert_eq!(super::client::ask(server.address, "HEAD", "/", &[]).header("content-length"), "1048576");
    let (statistics, entries) = server.stop();
    // What was handed to the connection is counted, which is little of what nobody took.
    let pages: Vec<_> =
        entries.iter().filter(|entry| entry.status == 200).map(|one| (one.complete, one.bytes)).collect();
    assert_eq!(pages.iter().filter(|page| **page == (true, 1 << 20)).count(), 1, "{pages:?}");
    assert_eq!(
        pages.iter().filter(|(complete, bytes)| !complete && *bytes < 1 << 18).count(),
        2,
        "{pages:?}"
    );
    assert_eq!(statistics.incomplete, 2);
}

#[test]
fn tls_offers_both_versions() {
    let folder = folder();
    let server = Running::start(folder.path(), |settings| settings.tls = Some(tls()));
    wait(async {
        ask_in_parallel(connect(server.address, "h2").await).await;
        let mut socket = connect(server.address, "http/1.1").await;
        socket
            .write_all(b"GET /talk/manifest.mpd HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
            .await
            .unwrap();
        let mut reply = String::new();
        socket.read_to_string(&mut reply).await.unwrap();
        assert!(reply.starts_with("HTTP/1.1 200") && reply.ends_with("<MPD/>"), "{reply}");
        // Without TLS there is nothing.
        let mut plain = TcpStream::connect(server.address).await.unwrap();
        plain.write_all(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n").await.unwrap();
        let mut reply = Vec::new();
        let _reset = plain.read_to_end(&mut reply).await;
        assert!(!reply.starts_with(b"HTTP"));
    });
    assert_eq!(server.stop().0.requests, 11);
}

#[test]
fn what_is_no_certificate_is_refused() {
    let folder = folder();
    let empty = folder.path().join("empty.pem");
    fs::write(&empty, "").unwrap();
    let missing = folder.path().join("missing.pem");
    let bad = [
        Tls { certificates: empty.clone(), ..tls() },
        Tls { certificates: missing.clone(), ..tls() },
        Tls { key: empty, ..tls() },
        Tls { key: missing, ..tls() },
        Tls { certificates: tls().key, ..tls() },
    ];
    for tls in bad {
        let mut settings = Settings::new(folder.path());
        settings.address.set_port(0);
        settings.tls = Some(tls.clone());
        assert!(matches!(Server::bind(&settings, |_| ()), Err(ServerError::Pem { .. })), "{tls:?}");
    }
}
