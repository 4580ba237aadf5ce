//! The baked model: a mesh with its tags in one checked little-endian file.
//!
//! ```text
//! magic "cutis\r\n\x1a" | version u32 | 0 u32 | payload length u64 | SHA-256 of the payload, 32 bytes | payload
//! payload: sections (tag of 4 bytes, length u64, content); a reader skips tags it does not know
//! ```

use std::path::Path;

use sha2::{Digest, Sha256};

use super::IoError;
use crate::math::Vec3;
use crate::mesh::{Elimination, FaceSet, NodeSet, TetMesh};

const MAGIC: [u8; 8] = *b"cutis\r\n\x1a";
/// Format written, and the newest that is read.
const VERSION: u32 = 1;
const HEADER: usize = 56;

/// A mesh as the bytes of a `.cutis` file.
pub fn encode(mesh: &TetMesh) -> Vec<u8> {
    let mut payload = Vec::with_capacity(24 * mesh.nodes.len() + 20 * mesh.tets.len() + 1024);
    section(&mut payload, b"NODE", |out| {
        mesh.nodes.iter().flat_map(|x| x.iter()).for_each(|c| out.extend(c.to_le_bytes()));
    });
    section(&mut payload, b"TETS", |out| put_u32(out, mesh.tets.as_flattened()));
    section(&mut payload, b"REGN", |out| {
        put_u32(out, &mesh.region);
    });
    section(&mut payload, b"RNAM", |out| mesh.region_names.iter().for_each(|n| put_name(out, n)));
    for set in &mesh.node_sets {
        section(&mut payload, b"NSET", |out| {
            put_name(out, &set.name);
            put_u32(out, &set.nodes);
        });
    }
    for set in &mesh.face_sets {
        section(&mut payload, b"FSET", |out| {
            put_name(out, &set.name);
            put_u32(out, set.triangles.as_flattened());
        });
    }
    if let Some(skin) = &mesh.fine_skin {
        section(&mut payload, b"SKNV", |out| {
            skin.vertices.iter().flat_map(|x| x.iter()).for_each(|c| out.extend(c.to_le_bytes()));
        });
        section(&mut payload, b"SKNT", |out| put_u32(out, skin.triangles.as_flattened()));
    }
    if let Some(elimination) = &mesh.elimination {
        section(&mut payload, b"ORDR", |out| {
            out.extend(elimination.pattern);
            put_u32(out, &elimination.order);
        });
    }
    let mut out = Vec::with_capacity(HEADER + payload.len());
    out.extend(MAGIC);
    out.extend(VERSION.to_le_bytes());
    out.extend(0u32.to_le_bytes());
    out.extend((payload.len() as u64).to_le_bytes());
    out.extend(Sha256::digest(&payload));
    out.extend(payload);
    out
}

fn section(out: &mut Vec<u8>, tag: &[u8; 4], fill: impl FnOnce(&mut Vec<u8>)) {
    out.extend(tag);
    let at = out.len();
    out.extend([0; 8]);
    fill(out);
    let length = (out.len() - at - 8) as u64;
    out[at..at + 8].copy_from_slice(&length.to_le_bytes());
}

fn put_u32(out: &mut Vec<u8>, values: &[u32]) {
    values.iter().for_each(|v| out.extend(v.to_le_bytes()));
}

fn put_name(out: &mut Vec<u8>, name: &str) {
    out.extend((name.len() as u32).to_le_bytes());
    out.extend(name.as_bytes());
}

/// The mesh in the bytes of a `.cutis` file; `path` only names it in errors.
///
/// # Errors
/// [`IoError::NotBaked`], [`IoError::TooNew`], [`IoError::Truncated`], [`IoError::Corrupt`] by what is wrong with the
/// file; [`IoError::Format`] and [`IoError::Mesh`] for content that a sound writer would not have made.
pub fn decode(bytes: &[u8], path: &Path) -> Result<TetMesh, IoError> {
    if bytes.len() < MAGIC.len() || bytes[..MAGIC.len()] != MAGIC {
        if !bytes.is_empty() && bytes.len() < MAGIC.len() && MAGIC.starts_with(bytes) {
            return Err(IoError::truncated(path, "the header", HEADER as u64, bytes.len() as u64));
        }
        return Err(IoError::NotBaked { path: path.into(), found: bytes[..bytes.len().min(8)].to_vec() });
    }
    if bytes.len() < HEADER {
        return Err(IoError::truncated(path, "the header", HEADER as u64, bytes.len() as u64));
    }
    let mut header = Cursor { bytes: &bytes[8..HEADER], path };
    let version = header.u32()?;
    if version > VERSION {
        return Err(IoError::TooNew { path: path.into(), found: version, known: VERSION });
    }
    header.u32()?;
    let length = header.u64()?;
    let payload = &bytes[HEADER..];
    if (payload.len() as u64) < length {
        return Err(IoError::truncated(path, "the payload", length, payload.len() as u64));
    }
    if payload.len() as u64 > length || Sha256::digest(payload).as_slice() != header.bytes {
        return Err(IoError::Corrupt { path: path.into() });
    }
    let mesh = sections(payload, path)?;
    mesh.checked().map_err(|source| IoError::Mesh { path: path.into(), source })
}

fn sections(payload: &[u8], path: &Path) -> Result<TetMesh, IoError> {
    let mut mesh = TetMesh::default();
    let mut cursor = Cursor { bytes: payload, path };
    while !cursor.bytes.is_empty() {
        let tag = cursor.take(4)?;
        let length = cursor.u64()?;
        let mut content = Cursor { bytes: cursor.take(usize::try_from(length).unwrap_or(usize::MAX))?, path };
        match tag {
            b"NODE" => mesh.nodes = content.places("NODE")?,
            b"TETS" => mesh.tets = content.rows::<16>("TETS")?.chunks_exact(16).map(numbers).collect(),
            b"REGN" => mesh.region = content.rows::<4>("REGN")?.chunks_exact(4).map(|b| numbers::<1>(b)[0]).collect(),
            b"RNAM" => {
                while !content.bytes.is_empty() {
                    mesh.region_names.push(content.name()?);
                }
            }
            b"NSET" => {
                let name = content.name()?;
                let nodes = content.rows::<4>("NSET")?.chunks_exact(4).map(|b| numbers::<1>(b)[0]).collect();
                mesh.node_sets.push(NodeSet { name, nodes });
            }
            b"FSET" => {
                let name = content.name()?;
                let triangles = content.rows::<12>("FSET")?.chunks_exact(12).map(numbers).collect();
                mesh.face_sets.push(FaceSet { name, triangles });
            }
            b"SKNV" => mesh.fine_skin.get_or_insert_default().vertices = content.places("SKNV")?,
            b"SKNT" => {
                let triangles = content.rows::<12>("SKNT")?.chunks_exact(12).map(numbers).collect();
                mesh.fine_skin.get_or_insert_default().triangles = triangles;
            }
            b"ORDR" => {
                let mut pattern = [0; 32];
                pattern.copy_from_slice(content.take(32)?);
                let order = content.rows::<4>("ORDR")?.chunks_exact(4).map(|b| numbers::<1>(b)[0]).collect();
                mesh.elimination = Some(Elimination { pattern, order });
            }
            _ => {}
        }
    }
    Ok(mesh)
}

fn numbers<const N: usize>(bytes: &[u8]) -> [u32; N] {
    let (words, _) = bytes.as_chunks::<4>();
    std::array::from_fn(|k| u32::from_le_bytes(words[k]))
}

/// What is left to read.
struct Cursor<'a> {
    bytes: &'a [u8],
    path: &'a Path,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], IoError> {
        let (head, rest) = self
            .bytes
            .split_at_checked(n)
            .ok_or_else(|| IoError::truncated(self.path, "a section", n as u64, self.bytes.len() as u64))?;
        self.bytes = rest;
        Ok(head)
    }

    fn u32(&mut self) -> Result<u32, IoError> {
        Ok(numbers::<1>(self.take(4)?)[0])
    }

    fn u64(&mut self) -> Result<u64, IoError> {
        let [low, high] = numbers::<2>(self.take(8)?);
        Ok(u64::from(low) | u64::from(high) << 32)
    }

    fn name(&mut self) -> Result<String, IoError> {
        let length = self.u32()? as usize;
        let bytes = self.take(length)?.to_vec();
        String::from_utf8(bytes).map_err(|_| IoError::format(self.path, "a name", "bytes", "UTF-8 text"))
    }

    /// Everything left, as points.
    fn places(&mut self, tag: &str) -> Result<Vec<Vec3>, IoError> {
        let (rows, _) = self.rows::<24>(tag)?.as_chunks::<8>();
        let values: Vec<f64> = rows.iter().map(|b| f64::from_le_bytes(*b)).collect();
        Ok(values.chunks_exact(3).map(Vec3::from_column_slice).collect())
    }

    /// Everything left, in rows of `N` bytes.
    fn rows<const N: usize>(&mut self, tag: &str) -> Result<&'a [u8], IoError> {
        if !self.bytes.len().is_multiple_of(N) {
            let found = format!("{} bytes", self.bytes.len());
            return Err(IoError::format(self.path, format!("section {tag}"), found, &format!("rows of {N} bytes")));
        }
        Ok(std::mem::take(&mut self.bytes))
    }
}
