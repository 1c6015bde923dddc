//! The answer to a request for a file.

use super::Shared;
use super::connection::Connection;
use super::folder::Found;
use super::range::{Answer, Version};
use super::transfer::Transfer;
use axum::Extension;
use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::response::Response;
use hyper::header::{
    ACCEPT_RANGES, ALLOW, CACHE_CONTROL, CONTENT_LENGTH, CONTENT_RANGE, CONTENT_TYPE, ETAG, HeaderName,
    LAST_MODIFIED, RETRY_AFTER, X_CONTENT_TYPE_OPTIONS,
};
use hyper::{Method, StatusCode};
use std::io::{self, Seek, SeekFrom};
use std::sync::Arc;

/// Answers one request; its transfer ends with the body.
pub(super) async fn answer(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    request: Request,
) -> Response {
    let transfer = Transfer::begin(shared, connection, &request);
    if let Some(page) = transfer.shared.page.clone().filter(|_| is_for_page(&request)) {
        return send_page(transfer, &request, page);
    }
    let network = &transfer.shared.network;
    if !network.latency.is_zero() {
        tokio::time::sleep(network.latency).await;
    }
    if !transfer.is_allowed() || network.fails(transfer.number) {
        return refuse(transfer, StatusCode::SERVICE_UNAVAILABLE, &[(RETRY_AFTER, "1")]);
    }
    if ![Method::GET, Method::HEAD].contains(request.method()) {
        return refuse(transfer, StatusCode::METHOD_NOT_ALLOWED, &[(ALLOW, "GET, HEAD, OPTIONS")]);
    }
    match find(&transfer.shared, request.uri().path()).await {
        Ok(Some(found)) => serve(transfer, &request, found),
        Ok(None) => refuse(transfer, StatusCode::NOT_FOUND, &[]),
        // Most likely there are too many open files.
        Err(_) => refuse(transfer, StatusCode::SERVICE_UNAVAILABLE, &[(RETRY_AFTER, "1")]),
    }
}

/// Whether a request is for the page in place of the folder's own.
fn is_for_page(request: &Request) -> bool {
    [Method::GET, Method::HEAD].contains(request.method()) && request.uri().path() == "/"
}

/// Answers with the page, of which all answers have the same bytes. It counts among the requests in flight as files do.
fn send_page(transfer: Transfer, request: &Request, page: Bytes) -> Response {
    if !transfer.is_allowed() {
        return refuse(transfer, StatusCode::SERVICE_UNAVAILABLE, &[(RETRY_AFTER, "1")]);
    }
    let length = page.len().to_string();
    let headers = [
        (CACHE_CONTROL, "no-cache"),
        (CONTENT_TYPE, "text/html; charset=utf-8"),
        (CONTENT_LENGTH, length.as_str()),
    ];
    let is_empty = request.method() == Method::HEAD || page.is_empty();
    let content = if is_empty { Content::Empty } else { Content::Page(page) };
    respond(transfer, StatusCode::OK, &headers, content)
}

/// Looks where waiting for a disk holds up nobody.
async fn find(shared: &Arc<Shared>, path: &str) -> io::Result<Option<Found>> {
    let (shared, path) = (Arc::clone(shared), path.to_owned());
    tokio::task::spawn_blocking(move || shared.folder.open(&path)).await.map_err(io::Error::other)?
}

fn serve(transfer: Transfer, request: &Request, mut found: Found) -> Response {
    let version = Version::new(found.length, found.modified);
    let answer = Answer::to(request.headers(), &version, found.length);
    let length = found.length;
    let (status, first, length, range) = match answer {
        Answer::Whole => (StatusCode::OK, 0, length, None),
        Answer::Part { first, length: part } => {
            let last = first.saturating_add(part).saturating_sub(1);
            (StatusCode::PARTIAL_CONTENT, first, part, Some(format!("bytes {first}-{last}/{length}")))
        }
        Answer::NotModified => (StatusCode::NOT_MODIFIED, 0, 0, None),
        Answer::PreconditionFailed => return refuse(transfer, StatusCode::PRECONDITION_FAILED, &[]),
        Answer::Unsatisfiable => {
            let range = format!("bytes */{length}");
            return refuse(transfer, StatusCode::RANGE_NOT_SATISFIABLE, &[(CONTENT_RANGE, &range)]);
        }
    };
    let mut headers = described(&found, &version, status, length);
    headers.extend(range.map(|range| (CONTENT_RANGE, range)));
    let headers: Vec<_> = headers.iter().map(|(name, value)| (name.clone(), value.as_str())).collect();
    if request.method() == Method::HEAD || length == 0 {
        return respond(transfer, status, &headers, Content::Empty);
    }
    match found.file.seek(SeekFrom::Start(first)) {
        Ok(_) => respond(transfer, status, &headers, Content::Part(found, length)),
        Err(_) => refuse(transfer, StatusCode::INTERNAL_SERVER_ERROR, &[]),
    }
}

/// What headers say of a file, and of the body, which has so many bytes.
fn described(found: &Found, version: &Version, status: StatusCode, length: u64) -> Vec<(HeaderName, String)> {
    let mut headers = vec![
        (ACCEPT_RANGES, "bytes".to_owned()),
        (CACHE_CONTROL, found.cache_control.to_owned()),
        (ETAG, version.etag.clone()),
        (LAST_MODIFIED, httpdate::fmt_http_date(version.modified)),
    ];
    if status != StatusCode::NOT_MODIFIED {
        headers.extend([
            (CONTENT_TYPE, found.content_type.to_owned()),
            (X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
            (CONTENT_LENGTH, length.to_string()),
        ]);
    }
    headers
}

enum Content {
    Empty,
    /// From where the file is, so many bytes.
    Part(Found, u64),
    Page(Bytes),
    /// A few words.
    Text(String),
}

/// An answer that says why there is no file. Caches do not keep it.
fn refuse(transfer: Transfer, status: StatusCode, headers: &[(HeaderName, &str)]) -> Response {
    let text = match transfer.entry.method.as_str() {
        "HEAD" => Content::Empty,
        _ => Content::Text(format!("{status}\n")),
    };
    let more = [(CACHE_CONTROL, "no-store"), (CONTENT_TYPE, "text/plain; charset=utf-8")];
    respond(transfer, status, &[headers, &more].concat(), text)
}

fn respond(
    mut transfer: Transfer,
    status: StatusCode,
    headers: &[(HeaderName, &str)],
    content: Content,
) -> Response {
    transfer.entry.status = status.as_u16();
    let body = match content {
        Content::Part(found, length) => transfer.send(found.file, length),
        Content::Page(page) => transfer.send_page(page),
        Content::Empty => {
            transfer.entry.complete = true;
            Body::empty()
        }
        Content::Text(text) => {
            transfer.entry.complete = true;
            transfer.entry.bytes = u64::try_from(text.len()).unwrap_or(u64::MAX);
            Body::from(text)
        }
    };
    let mut response = Response::new(body);
    *response.status_mut() = status;
    for (name, value) in headers {
        // Nothing that is not a value is among them: names of files are not.
        if let Ok(value) = value.parse() {
            response.headers_mut().insert(name, value);
        }
    }
    response
}
