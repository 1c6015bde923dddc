//! A small HTTP server that misbehaves where it is told to.

use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A request for bytes of a file.
#[derive(Debug, Clone)]
pub(crate) struct Request {
    /// How many came before it.
    pub(crate) number: usize,
    pub(crate) file: String,
    /// First and last byte; none for the whole file.
    pub(crate) range: Option<(usize, usize)>,
    pub(crate) if_range: Option<String>,
    pub(crate) if_none_match: Option<String>,
    /// Number of the connection.
    pub(crate) connection: usize,
}

/// What the server does.
#[derive(Debug, Clone)]
pub(crate) enum Answer {
    Well,
    Status(u16),
    /// So many bytes of the body but not the last, and the end of the connection.
    Short(usize),
    /// One bit of the body is another one.
    Flip,
    /// The connection ends without an answer.
    Reset,
    /// After this time.
    Late(Duration),
    /// A byte of the body after the other, with this time before each.
    Slow(Duration),
    /// Without regard to ranges.
    Whole,
    /// Another range, of the same length.
    Other,
    /// A head, and the same text after it until the client leaves.
    Endless(&'static str, &'static str),
    /// To another address.
    Elsewhere(&'static str),
}

type Behaviour = dyn Fn(&Request) -> Answer + Send + Sync;

/// What it serves.
pub(crate) struct Content {
    pub(crate) files: BTreeMap<String, Vec<u8>>,
    pub(crate) tag: String,
}

pub(crate) struct Server {
    pub(crate) url: String,
    pub(crate) content: Arc<Mutex<Content>>,
    pub(crate) requests: Arc<Mutex<Vec<Request>>>,
}

impl Server {
    pub(crate) fn start(
        files: BTreeMap<String, Vec<u8>>,
        behaviour: impl Fn(&Request) -> Answer + Send + Sync + 'static,
    ) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}/package/", listener.local_addr().unwrap());
        let content = Arc::new(Mutex::new(Content { files, tag: "\"1\"".into() }));
        let requests = Arc::new(Mutex::new(Vec::new()));
        let behaviour: Arc<Behaviour> = Arc::new(behaviour);
        let shared = (content.clone(), requests.clone());
        std::thread::spawn(move || {
            for (connection, stream) in listener.incoming().enumerate() {
                let (content, requests) = shared.clone();
                let behaviour = behaviour.clone();
                std::thread::spawn(move || {
                    let _closed = serve(stream.unwrap(), connection, &content, &requests, &*behaviour);
                });
            }
        });
        Self { url, content, requests }
    }
}

/// Answers the requests of a connection, until one of the two closes it.
fn serve(
    stream: TcpStream,
    connection: usize,
    content: &Mutex<Content>,
    requests: &Mutex<Vec<Request>>,
    behaviour: &Behaviour,
) -> Option<()> {
    let mut reader = BufReader::new(stream.try_clone().ok()?);
    loop {
        let mut request = read(&mut reader)?;
        request.connection = connection;
        {
            let mut all = requests.lock().unwrap();
            request.number = all.len();
            all.push(request.clone());
        }
        answer(&stream, &request, behaviour(&request), content)?;
    }
}

fn read(reader: &mut impl BufRead) -> Option<Request> {
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let path = line.split(' ').nth(1)?;
    let file = path.rsplit('/').next()?.to_owned();
    let mut request =
        Request { number: 0, file, range: None, if_range: None, if_none_match: None, connection: 0 };
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).ok()?;
        let Some((name, value)) = line.trim().split_once(": ") else { return Some(request) };
        match name.to_ascii_lowercase().as_str() {
            "range" => {
                let (first, last) = value.strip_prefix("bytes=")?.split_once('-')?;
                request.range = Some((first.parse().ok()?, last.parse().ok()?));
            }
            "if-range" => request.if_range = Some(value.to_owned()),
            "if-none-match" => request.if_none_match = Some(value.to_owned()),
            _ => {}
        }
    }
}

fn answer(mut stream: &TcpStream, request: &Request, answer: Answer, content: &Mutex<Content>) -> Option<()> {
    match answer {
        Answer::Endless(head, rest) => {
            stream.write_all(head.as_bytes()).ok()?;
            let rest = rest.repeat(1 << 12);
            while stream.write_all(rest.as_bytes()).is_ok() {}
            return None;
        }
        Answer::Elsewhere(to) => {
            return write!(stream, "HTTP/1.1 302 Found\r\nLocation: {to}\r\nContent-Length: 0\r\n\r\n").ok();
        }
        _ => {}
    }
    let (file, tag) = {
        let content = content.lock().unwrap();
        let file = content.files.get(&request.file).cloned();
        // A manifest changes by itself.
        let tag = match &file {
            Some(bytes) if request.file == "manifest.json" => {
                format!("\"{:x?}\"", &Sha256::digest(bytes)[..8])
            }
            _ => content.tag.clone(),
        };
        (file, tag)
    };
    let status = match (&answer, &file) {
        (Answer::Status(status), _) => Some(*status),
        (_, None) => Some(404),
        _ => None,
    };
    if let Some(status) = status {
        return write!(stream, "HTTP/1.1 {status} No\r\nContent-Length: 2\r\n\r\nno").ok();
    }
    if request.if_none_match.as_ref() == Some(&tag) && matches!(answer, Answer::Well) {
        return write!(stream, "HTTP/1.1 304 Not Modified\r\nETag: {tag}\r\n\r\n").ok();
    }
    let file = file?;
    let is_same = request.if_range.as_ref().is_none_or(|known| *known == tag);
    let range = request.range.filter(|_| is_same && !matches!(answer, Answer::Whole));
    let (first, last) = range.unwrap_or((0, file.len() - 1));
    let mut body = file[first..=last].to_vec();
    let shift = usize::from(matches!(answer, Answer::Other));
    let head = match range {
        Some(_) => {
            format!("206 Partial\r\nContent-Range: bytes {}-{}/{}", first + shift, last + shift, file.len())
        }
        None => "200 OK".to_owned(),
    };
    let length = body.len();
    match answer {
        Answer::Reset => return None,
        Answer::Late(time) => std::thread::sleep(time),
        Answer::Flip => *body.last_mut()? ^= 1,
        Answer::Short(bytes) => body.truncate(bytes.min(length - 1)),
        _ => {}
    }
    write!(stream, "HTTP/1.1 {head}\r\nETag: {tag}\r\nContent-Length: {length}\r\n\r\n").ok()?;
    if let Answer::Slow(pause) = answer {
        for byte in &body {
            std::thread::sleep(pause);
            stream.write_all(&[*byte]).ok()?;
        }
        return Some(());
    }
    stream.write_all(&body).ok()?;
    (body.len() == length).then_some(())
}
