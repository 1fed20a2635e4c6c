//! What a file is, by its first bytes.

use crate::without_mark;

/// Longest excerpt of a text that a message quotes.
const EXCERPT: usize = 60;

/// What stands in the place of data, if these bytes are that: nothing, a pointer of Git LFS or git-annex, a web page, or an archive. It completes a
/// sentence that begins with the file's name.
pub fn stand_in(bytes: &[u8]) -> Option<String> {
    placeholder(bytes).or_else(|| Some(format!("it is {}, not the data; unpack it first", archive(bytes)?)))
}

/// As [`stand_in`], without archives: what no file of any kind of data begins with, raw numbers included.
pub fn placeholder(bytes: &[u8]) -> Option<String> {
    if bytes.is_empty() {
        return Some("the file is empty".into());
    }
    let bytes = without_mark(bytes);
    let head = &bytes[..bytes.len().min(1024)];
    const POINTERS: [&[u8]; 3] =
        [b"version https://git-lfs.github.com/spec/", b"version https://hawser.github.com/spec/", b"version http://git-media.io/v/"];
    if POINTERS.iter().any(|start| head.starts_with(start)) {
        let text = String::from_utf8_lossy(head);
        let size = text.lines().find_map(|line| line.strip_prefix("size ")).and_then(|size| size.trim().parse::<u64>().ok());
        let size = size.map(|size| format!(" of {size} bytes")).unwrap_or_default();
        return Some(format!("it is a Git LFS pointer, not the data{size}; `git lfs pull` in its repository fetches it"));
    }
    let lower = head.trim_ascii_start().to_ascii_lowercase();
    if lower.starts_with(b"/annex/objects/") || lower.starts_with(b"../.git/annex/objects/") || lower.starts_with(b".git/annex/objects/") {
        return Some("it is a git-annex pointer, not the data; `git annex get` fetches it".into());
    }
    if [b"<!doctype html".as_slice(), b"<html", b"<head", b"<body"].iter().any(|start| lower.starts_with(start)) {
        return Some(
            "it is a web page (HTML), not the data: a download that failed, or the page about the file instead of the file".into(),
        );
    }
    if [b"<?xml".as_slice(), b"<error", b"<svg", b"<!doctype", b"<!--"].iter().any(|start| lower.starts_with(start)) {
        return Some("it is an XML document, not the data: perhaps a server's error message".into());
    }
    None
}

fn archive(bytes: &[u8]) -> Option<&'static str> {
    const STARTS: [(&[u8], &str); 9] = [
        (b"PK\x03\x04", "a zip archive"),
        (b"PK\x05\x06", "an empty zip archive"),
        (b"\x1f\x8b\x08", "a gzip archive"),
        (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
        (b"Rar!\x1a\x07", "a RAR archive"),
        (b"\xfd7zXZ\0", "an xz archive"),
        (b"\x28\xb5\x2f\xfd", "a Zstandard archive"),
        (b"BZh", "a bzip2 archive"),
        (b"LZIP", "an lzip archive"),
    ];
    let found = STARTS.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, name)| *name);
    found.or_else(|| (bytes.get(257..262) == Some(b"ustar")).then_some("a tar archive"))
}

/// The kind of file, with its article, for those kinds that a scene, a picture or a graph might be confused with.
pub fn kind(bytes: &[u8]) -> Option<&'static str> {
    const STARTS: [(&[u8], &str); 19] = [
        (b"glTF", "a binary glTF file"),
        (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
        (b"#?", "a Radiance HDR picture"),
        (b"\xabKTX 20\xbb\r\n\x1a\n", "a KTX2 texture"),
        (b"\xabKTX 11\xbb\r\n\x1a\n", "a KTX texture"),
        (b"DDS ", "a DDS texture"),
        (b"GIF8", "a GIF picture"),
        (b"II*\0", "a TIFF picture"),
        (b"MM\0*", "a TIFF picture"),
        (b"8BPS", "a Photoshop picture"),
        (b"\0\0\0\x0cjP  ", "a JPEG 2000 picture"),
        (b"\xff\x0a", "a JPEG XL picture"),
        (b"BLENDER", "a Blender file"),
        (b"Kaydara FBX Binary", "an FBX file"),
        (b"PXR-USDC", "a USD file"),
        (b"#usda", "a USD file"),
        (b"%PDF", "a PDF document"),
    ];
    if let Some((_, name)) = STARTS.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Some(name);
    }
    match (bytes.get(..4), bytes.get(4..12)) {
        (Some(b"RIFF"), Some([_, _, _, _, b'W', b'E', b'B', b'P'])) => Some("a WebP picture"),
        (_, Some(b"ftypavif" | b"ftypavis")) => Some("an AVIF picture"),
        (_, Some(b"ftypheic" | b"ftypheix" | b"ftypmif1")) => Some("a HEIF picture"),
        _ => None,
    }
}

/// What these bytes are, where they are not what was expected: [`stand_in`], [`kind`], zeros, or the beginning of a text. Nothing if nobody can tell.
pub fn describe(bytes: &[u8]) -> Option<String> {
    if let Some(what) = stand_in(bytes) {
        return Some(what);
    }
    if let Some(kind) = kind(bytes) {
        return Some(format!("it is {kind}"));
    }
    if bytes.iter().all(|byte| *byte == 0) {
        return Some("it holds only zeros: a download that was never finished".into());
    }
    let head = without_mark(bytes);
    let head = &head[..head.len().min(512)];
    let text = match std::str::from_utf8(head) {
        Ok(text) => text,
        // The end may have cut a character.
        Err(error) if error.valid_up_to() + 4 > head.len() => std::str::from_utf8(&head[..error.valid_up_to()]).unwrap_or_default(),
        Err(_) => return None,
    };
    let printable = |character: char| !character.is_control() || character.is_ascii_whitespace();
    let line = text.trim().lines().next().unwrap_or_default();
    if line.is_empty() || !text.chars().all(printable) {
        return None;
    }
    let excerpt: String = line.chars().take(EXCERPT).collect();
    Some(format!("it is text that begins with `{excerpt}`"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";

    #[test]
    fn what_stands_in_is_recognised() {
        let cases: [(&[u8], &str); 11] = [
            (b"", "the file is empty"),
            (POINTER, "it is a Git LFS pointer, not the data of 12345 bytes"),
            (b"/annex/objects/SHA256E-s1--a.exr\n", "a git-annex pointer"),
            (b"\n<!DOCTYPE html><title>Not found</title>", "a web page (HTML)"),
            (b"\xef\xbb\xbf<HTML>", "a web page (HTML)"),
            (b"<?xml version=\"1.0\"?><Error><Code>AccessDenied</Code></Error>", "an XML document"),
            (b"PK\x03\x04\x14\0", "a zip archive, not the data; unpack it first"),
            (b"\x1f\x8b\x08\0", "a gzip archive"),
            (b"7z\xbc\xaf\x27\x1c\0", "a 7z archive"),
            (b"Rar!\x1a\x07\0", "a RAR archive"),
            (&[&[0; 257][..], b"ustar\0"].concat(), "a tar archive"),
        ];
        for (bytes, expected) in cases {
            let found = stand_in(bytes).unwrap();
            assert!(found.contains(expected), "`{expected}` is not in: {found}");
        }
        for data in [b"glTF\x02\0\0\0".as_slice(), b"{\"asset\": {}}", b"(passes: {})", b"\x89PNG\r\n\x1a\n", b"#?RADIANCE\n", &[0; 300]] {
            assert_eq!(stand_in(data), None);
        }
    }

    #[test]
    fn other_kinds_are_named_and_text_is_quoted() {
        let cases: [(&[u8], &str); 7] = [
            (b"404: Not Found", "it is text that begins with `404: Not Found`"),
            (b"\x89PNG\r\n\x1a\n\0\0", "it is a PNG picture"),
            (b"RIFF\x10\0\0\0WEBPVP8L", "it is a WebP picture"),
            (b"\0\0\0\x1cftypavif", "it is an AVIF picture"),
            (b"BLENDER-v404", "it is a Blender file"),
            (&[0; 64], "it holds only zeros"),
            (POINTER, "a Git LFS pointer"),
        ];
        for (bytes, expected) in cases {
            let found = describe(bytes).unwrap();
            assert!(found.contains(expected), "`{expected}` is not in: {found}");
        }
        assert_eq!(describe(&[1, 2, 3, 200, 201]), None);
        let long = describe("ä".repeat(400).as_bytes()).unwrap();
        assert_eq!(long.chars().filter(|character| *character == 'ä').count(), EXCERPT);
    }
}
