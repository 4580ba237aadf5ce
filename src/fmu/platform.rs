//! Machines that an archive can hold a library for: their folders, file names, and how their libraries begin.

use std::fmt;
use std::str::FromStr;

use super::{FmiVersion, MODEL_IDENTIFIER};

/// A machine as FMI 3.0 names its folder, for example `x86_64-linux`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Platform(&'static str);

/// Folder in FMI 3.0 and in FMI 2.0.
const FOLDERS: [(&str, &str); 6] = [
    ("x86_64-linux", "linux64"),
    ("aarch64-linux", "aarch64-linux"),
    ("x86_64-windows", "win64"),
    ("aarch64-windows", "aarch64-windows"),
    ("x86_64-darwin", "darwin64"),
    ("aarch64-darwin", "aarch64-darwin"),
];

/// There is no such platform.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` is no platform; the choices are {choices}", choices = FOLDERS.map(|(name, _)| name).join(", "))]
pub struct UnknownPlatform(String);

impl FromStr for Platform {
    type Err = UnknownPlatform;

    fn from_str(name: &str) -> Result<Self, UnknownPlatform> {
        let known = FOLDERS.iter().find(|(folder, _)| *folder == name);
        known.map(|(folder, _)| Platform(folder)).ok_or_else(|| UnknownPlatform(name.to_owned()))
    }
}

impl fmt::Display for Platform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

impl Platform {
    /// The one this program runs on.
    ///
    /// # Errors
    /// [`UnknownPlatform`] where the standard has no name for it.
    pub fn here() -> Result<Platform, UnknownPlatform> {
        let os = if std::env::consts::OS == "macos" { "darwin" } else { std::env::consts::OS };
        format!("{}-{os}", std::env::consts::ARCH).parse()
    }

    /// Its folder under `binaries/`.
    pub fn folder(self, version: FmiVersion) -> &'static str {
        match version {
            FmiVersion::V3 => self.0,
            FmiVersion::V2 | FmiVersion::V2Full => {
                FOLDERS.iter().find(|(name, _)| *name == self.0).map_or(self.0, |(_, old)| old)
            }
        }
    }

    /// Path of its library inside an archive.
    pub fn library(self, version: FmiVersion) -> String {
        let suffix = match self.0.split_once('-') {
            Some((_, "windows")) => "dll",
            Some((_, "darwin")) => "dylib",
            _ => "so",
        };
        format!("binaries/{}/{MODEL_IDENTIFIER}.{suffix}", self.folder(version))
    }

    /// The platform whose loader takes a library that begins so: ELF, PE or Mach-O.
    pub fn of_library(bytes: &[u8]) -> Option<Platform> {
        let word = |at: usize| Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
        let long = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        let name = match bytes {
            [0x7f, b'E', b'L', b'F', ..] => match word(18)? {
                62 => "x86_64-linux",
                183 => "aarch64-linux",
                _ => return None,
            },
            [b'M', b'Z', ..] => match word(long(60)? as usize + 4)? {
                0x8664 => "x86_64-windows",
                0xaa64 => "aarch64-windows",
                _ => return None,
            },
            [0xcf, 0xfa, 0xed, 0xfe, ..] => match long(4)? {
                0x0100_0007 => "x86_64-darwin",
                0x0100_000c => "aarch64-darwin",
                _ => return None,
            },
            _ => return None,
        };
        name.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_told_apart_by_their_first_bytes() {
        let mut elf = [0; 20];
        elf[..4].copy_from_slice(b"\x7fELF");
        elf[18] = 183;
        assert_eq!(Platform::of_library(&elf), Some(Platform("aarch64-linux")));
        let mut pe = [0; 72];
        pe[..2].copy_from_slice(b"MZ");
        (pe[60], pe[68], pe[69]) = (64, 0x64, 0x86);
        assert_eq!(Platform::of_library(&pe), Some(Platform("x86_64-windows")));
        pe[60] = 255;
        assert_eq!(Platform::of_library(&pe), None);
        assert_eq!(Platform::of_library(b"text"), None);
    }

    #[test]
    fn folders_follow_the_version() {
        let windows: Platform = "x86_64-windows".parse().unwrap();
        assert_eq!(windows.library(FmiVersion::V2), "binaries/win64/cutis.dll");
        assert_eq!(windows.library(FmiVersion::V3), "binaries/x86_64-windows/cutis.dll");
        assert!("amiga".parse::<Platform>().unwrap_err().to_string().contains("x86_64-linux, aarch64-linux"));
    }
}
