//! Where an instance finds its scene: the archive's resources folder, or the copy inside the library.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::load;
use crate::sim::Model;

/// File name of the scene in an archive's resources folder.
pub(super) const SCENE: &str = "scene.toml";

/// The model of an archive; without a folder, or without a scene in it, the default scene inside the library.
///
/// # Errors
/// Those of loading a scene.
pub(super) fn model(folder: Option<&Path>) -> Result<Model, Error> {
    let loaded = match folder.map(|f| f.join(SCENE)).filter(|scene| scene.is_file()) {
        Some(scene) => load::from_file(&scene)?,
        None => load::embedded()?,
    };
    Ok(loaded.model)
}

/// Path of an `fmuResourceLocation` (FMI 2.0): `file:///p`, `file:/p`, `file://localhost/p`, percent-encoded or not,
/// with or without trailing slash; a plain absolute path is taken as it is.
///
/// # Errors
/// What is wrong with it, in words.
pub(super) fn path_of_uri(uri: &str) -> Result<PathBuf, String> {
    let Some(rest) = strip_scheme(uri) else {
        let plain = PathBuf::from(uri);
        return if plain.is_absolute() {
            Ok(plain)
        } else {
            Err(format!("`{uri}` is no file URI: wanted file:///folder"))
        };
    };
    let path = match rest.strip_prefix("//") {
        Some(authority_and_path) => {
            let slash = authority_and_path.find('/').ok_or_else(|| format!("`{uri}` names no folder"))?;
            let (authority, path) = authority_and_path.split_at(slash);
            if !(authority.is_empty() || authority.eq_ignore_ascii_case("localhost")) {
                return Err(format!("`{uri}` lies on another machine: `{authority}`"));
            }
            path
        }
        None => rest,
    };
    let path = decode(path).ok_or_else(|| format!("`{uri}` has a broken percent code, or is not UTF-8"))?;
    // A drive letter stands behind a slash that belongs to the URI alone: /C:/folder.
    let drive = path.len() > 2 && path.as_bytes()[2] == b':' && path.as_bytes()[1].is_ascii_alphabetic();
    Ok(PathBuf::from(if drive { &path[1..] } else { &path[..] }))
}

fn strip_scheme(uri: &str) -> Option<&str> {
    let (scheme, rest) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("file").then_some(rest)
}

fn decode(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        if first == b'%' {
            let hex = tail.get(..2).filter(|h| h.iter().all(u8::is_ascii_hexdigit))?;
            bytes.push(u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok()?);
            rest = &tail[2..];
        } else {
            bytes.push(first);
            rest = tail;
        }
    }
    String::from_utf8(bytes).ok().filter(|s| !s.contains('\0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_of_a_file_uri() {
        for uri in ["file:///tmp/a b", "file:/tmp/a%20b", "file://localhost/tmp/a%20b", "FILE:///tmp/a%20b", "/tmp/a b"]
        {
            assert_eq!(path_of_uri(uri).unwrap(), PathBuf::from("/tmp/a b"), "{uri}");
        }
        assert_eq!(path_of_uri("file:///tmp/%C3%A9/").unwrap(), PathBuf::from("/tmp/\u{e9}/"));
        assert_eq!(path_of_uri("file:///C:/fmu").unwrap(), PathBuf::from("C:/fmu"));
        for bad in [
            "",
            "http://x/y",
            "file://host/y",
            "file:///a%2",
            "file:///a%zz",
            "file:///%ff",
            "file:///%00",
            "relative",
            "file://x",
        ] {
            assert!(path_of_uri(bad).is_err(), "{bad}");
        }
    }
}
