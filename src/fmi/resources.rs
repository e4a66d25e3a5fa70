//! The place of the unpacked FMU's resources, from the URI that the importer gives.

use std::path::PathBuf;

/// Path of a `file:` URI as `fmi2Instantiate` gets it, percent signs decoded; `None` when it is none.
///
/// Read are `file:///path`, `file:/path`, `file://localhost/path`, Windows paths (`file:///C:/path`) and,
/// since some importers do it, a bare absolute path.
pub fn path_of_uri(uri: &str) -> Option<PathBuf> {
    let Some(rest) = uri.strip_prefix("file:") else {
        let path = PathBuf::from(uri);
        return path.is_absolute().then_some(path);
    };
    let encoded = match rest.strip_prefix("//") {
        Some(with_host) => {
            let path = &with_host[with_host.find('/')?..];
            let host = &with_host[..with_host.len() - path.len()];
            if !(host.is_empty() || host.eq_ignore_ascii_case("localhost")) {
                return None;
            }
            path
        }
        None => rest,
    };
    if !encoded.starts_with('/') {
        return None;
    }
    let bytes = decode_percent(encoded)?;
    let is_windows = bytes.len() > 2 && bytes[1].is_ascii_alphabetic() && bytes[2] == b':';
    Some(path_of_bytes(if is_windows { bytes[1..].to_vec() } else { bytes }))
}

/// Replaces `%20` and its like by their bytes; `None` for a percent sign without two hexadecimal digits or a
/// zero byte.
fn decode_percent(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        let byte = if byte == b'%' {
            let mut digit = || char::from(rest.next()?).to_digit(16);
            u8::try_from(16 * digit()? + digit()?).ok()?
        } else {
            byte
        };
        if byte == 0 {
            return None;
        }
        bytes.push(byte);
    }
    Some(bytes)
}

#[cfg(unix)]
fn path_of_bytes(bytes: Vec<u8>) -> PathBuf {
    // A Unix path need not be UTF-8, and the URI can spell any.
    use std::os::unix::ffi::OsStringExt;
    std::ffi::OsString::from_vec(bytes).into()
}

#[cfg(not(unix))]
fn path_of_bytes(bytes: Vec<u8>) -> PathBuf {
    String::from_utf8_lossy(&bytes).into_owned().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The forms that importers use, with spaces, percent signs and umlauts.
    #[test]
    fn uris_of_importers_give_their_paths() {
        let cases = [
            ("file:///tmp/fmu/resources", "/tmp/fmu/resources"),
            ("file:/tmp/fmu/resources", "/tmp/fmu/resources"),
            ("file://localhost/tmp/a", "/tmp/a"),
            ("file:///tmp/with%20space/100%25/%C3%BCber", "/tmp/with space/100%/über"),
            ("file:///tmp/with space/über", "/tmp/with space/über"),
            ("file:///C:/fmu/resources", "C:/fmu/resources"),
        ];
        for (uri, path) in cases {
            assert_eq!(path_of_uri(uri), Some(PathBuf::from(path)), "{uri}");
        }
        #[cfg(unix)]
        assert_eq!(path_of_uri("/tmp/a"), Some(PathBuf::from("/tmp/a")));
    }

    /// What is no file is no path, and never a panic.
    #[test]
    fn other_uris_give_none() {
        for uri in ["", "file:", "file:a", "file://", "file://host/a", "http://a/b", "a/b"] {
            assert_eq!(path_of_uri(uri), None, "{uri}");
        }
        for uri in ["file:///a%", "file:///a%2", "file:///a%zz", "file:///a%00b", "file:///%ü"] {
            assert_eq!(path_of_uri(uri), None, "{uri}");
        }
    }
}
