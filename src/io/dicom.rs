//! DICOM CT: a series of slices in a folder, or the frames of one file.
//!
//! Slices are ordered by their position along the slice normal, never by number or file name. What lies beside them and
//! is no slice of the series is passed over and told; an odd one among the slices is named, by comparison with most.
//!
//! Source: DICOM PS3.3 2024, C.7.6.2 (image plane) and C.8.2.1 (CT image).

mod data_set;
mod file;
mod image;
mod jpeg;
mod jpeg_ls;
mod markers;
mod pixels;
mod rle;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use image::{Object, Slice};

use super::IoError;
use super::ct;
use super::file::read_bytes;
use crate::geometry::Volume;
use crate::math::Vec3;

/// Slice distances may differ by this share of the usual one (rounding of the header's decimals).
const UNEVEN: f64 = 0.02;
/// Sideways drift of the slices, as share of their distance, that counts as tilt (0.3 degrees).
const TILT: f64 = 5e-3;
/// Orientation cosines of one series agree to this.
const SAME: f64 = 1e-4;
/// Tilt of the gantry that is told where the slices show none, degrees.
const TILTED: f64 = 0.3;
/// Names that are listed before the rest is only counted.
const LISTED: usize = 4;
/// Resource forks that macOS leaves beside files of other systems.
const RESOURCE_FORK: &str = "._";
const INDEX: &str = "DICOMDIR";

/// The series in a folder.
pub(super) fn read_series(folder: &Path, told: &mut Vec<String>) -> Result<Volume, IoError> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .and_then(|entries| entries.map(|e| e.map(|e| e.path())).collect())
        .map_err(IoError::file(folder))?;
    files.sort();
    let folders = files.iter().filter(|f| f.is_dir()).map(|f| name(f)).collect::<Vec<_>>();
    let mut pile = Pile::default();
    for file in files.iter().filter(|f| f.is_file()) {
        pile.add(file, told)?;
    }
    pile.stacked(folder, &folders, told)
}

/// The frames of one file.
pub(super) fn read_frames(path: &Path, told: &mut Vec<String>) -> Result<Volume, IoError> {
    let mut pile = Pile::default();
    pile.add(path, told)?;
    if pile.slices.len() == 1 {
        return Err(IoError::unsupported(path, "one DICOM slice", "give the folder that holds the series"));
    }
    pile.stacked(path, &[], told)
}

fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// A few names, and how many more there are.
fn list(names: &[String]) -> String {
    let few = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > LISTED { format!("{few} and {} more", names.len() - LISTED) } else { few }
}

/// What was found so far.
#[derive(Default)]
struct Pile {
    slices: Vec<Slice>,
    /// Files that are no slices, by why.
    beside: BTreeMap<String, Vec<String>>,
    /// An image of another modality.
    other: Option<(PathBuf, String)>,
}

impl Pile {
    fn add(&mut self, path: &Path, told: &mut Vec<String>) -> Result<(), IoError> {
        let file_name = name(path);
        let mut beside = |why: &str| {
            self.beside.entry(why.into()).or_default().push(file_name.clone());
            Ok(())
        };
        if file_name.starts_with(RESOURCE_FORK) {
            return beside("leftover of macOS");
        }
        if file_name.eq_ignore_ascii_case(INDEX) {
            return beside("index of a medium");
        }
        let bytes = read_bytes(path)?;
        let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dcm") || e.eq_ignore_ascii_case("ima"));
        let Some(file) = file::open(path, &bytes, told)? else {
            if named {
                let found = format!("{} bytes without the DICOM mark", bytes.len());
                return Err(IoError::format(path, "byte 128", found, "`DICM`: copy the file again, or leave it out"));
            }
            return beside("no DICOM");
        };
        match image::read(path, &file, told)? {
            Object::Slices(slices) => self.slices.extend(slices),
            Object::Beside(why) => beside(&why)?,
            Object::Other(modality) => {
                beside(&format!("{modality} image"))?;
                self.other.get_or_insert_with(|| (path.into(), modality));
            }
        }
        Ok(())
    }

    fn stacked(self, folder: &Path, folders: &[String], told: &mut Vec<String>) -> Result<Volume, IoError> {
        let Self { mut slices, beside, other } = self;
        if let Some((path, found)) = other.filter(|_| slices.is_empty()) {
            return Err(IoError::Modality { path, found });
        }
        let passed =
            beside.iter().map(|(why, names)| format!("{} ({why})", list(names))).collect::<Vec<_>>().join("; ");
        drop_copies(&mut slices, told);
        if slices.len() < 2 {
            let mut found = format!("{} CT slice(s) in the folder", slices.len());
            if !passed.is_empty() {
                found += &format!(", beside {passed}");
            }
            let mut advice = "a CT series of at least 2 slices is needed".to_owned();
            if !folders.is_empty() {
                advice += &format!(": it may be in a folder below ({})", list(folders));
            }
            return Err(IoError::unsupported(folder, found, advice));
        }
        if !passed.is_empty() {
            told.push(format!("passed over: {passed}"));
        }
        one_series(folder, &slices)?;
        let normal = slices[0].row.cross(&slices[0].column);
        slices.sort_by(|a, b| a.origin.dot(&normal).total_cmp(&b.origin.dot(&normal)));
        let step = stacking(folder, &slices, &normal)?;
        headers_agree(&slices, &normal, step.norm(), told);
        let first = &slices[0];
        let dims = [first.size[0], first.size[1], slices.len()];
        // Pixel spacing names the distance of rows first: that is the step down a column.
        let axes = [first.row * first.spacing[1], first.column * first.spacing[0], step];
        let grid = ct::grid(folder, dims, axes, first.origin)?;
        ct::room(folder, grid.len())?;
        let samples = slices.into_iter().flat_map(|s| s.samples).collect();
        ct::volume(folder, grid, samples)
    }
}

/// Leaves one of each slice that is there twice: the same instance with the same samples.
fn drop_copies(slices: &mut Vec<Slice>, told: &mut Vec<String>) {
    let mut copies = Vec::new();
    let mut kept: Vec<Slice> = Vec::with_capacity(slices.len());
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    for slice in slices.drain(..) {
        let same = known.get(&slice.instance).filter(|_| !slice.instance.is_empty()).map(|&k| &kept[k]);
        if same.is_some_and(|s| s.origin == slice.origin && s.samples == slice.samples) {
            copies.push(name(&slice.path));
            continue;
        }
        known.insert(slice.instance.clone(), kept.len());
        kept.push(slice);
    }
    *slices = kept;
    if !copies.is_empty() {
        told.push(format!("slices that are there twice count once: {}", list(&copies)));
    }
}

/// All slices are of one series and one shape.
fn one_series(folder: &Path, slices: &[Slice]) -> Result<(), IoError> {
    let mut series: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    slices.iter().for_each(|s| series.entry(&s.series).or_default().push(name(&s.path)));
    if series.len() > 1 {
        let list = series.iter().map(|(uid, names)| format!("{} of {uid}: {}", names.len(), list(names)));
        let list = list.collect::<Vec<_>>().join("; ");
        return Err(IoError::MixedSeries { path: folder.into(), found: series.len(), list });
    }
    let mut shapes: Vec<(&Slice, Vec<&Slice>)> = Vec::new();
    for slice in slices {
        match shapes.iter_mut().find(|(first, _)| difference(first, slice).is_none()) {
            Some((_, alike)) => alike.push(slice),
            None => shapes.push((slice, vec![slice])),
        }
    }
    // Of two equally many the first counts.
    shapes.sort_by_key(|(_, alike)| std::cmp::Reverse(alike.len()));
    let [(usual, _), odd @ ..] = shapes.as_slice() else { return Ok(()) };
    let Some((first, _)) = odd.first() else { return Ok(()) };
    let names: Vec<String> = odd.iter().flat_map(|(_, alike)| alike.iter().map(|s| name(&s.path))).collect();
    let found = format!(
        "{} of {} slices unlike the others: {} ({})",
        names.len(),
        slices.len(),
        list(&names),
        difference(usual, first).unwrap_or_default()
    );
    Err(IoError::unsupported(folder, found, "leave scouts and reformatted slices out of the folder"))
}

/// In what a slice is unlike the usual ones.
fn difference(usual: &Slice, slice: &Slice) -> Option<String> {
    let cosines =
        |s: &Slice| [s.row, s.column].iter().map(|v| format!("{:.4?}", v.as_slice())).collect::<Vec<_>>().join(" ");
    if slice.size != usual.size {
        let [columns, rows] = slice.size;
        return Some(format!("{rows} rows and {columns} columns instead of {} and {}", usual.size[1], usual.size[0]));
    }
    if (slice.row - usual.row).norm() > SAME || (slice.column - usual.column).norm() > SAME {
        return Some(format!("orientation {} instead of {}", cosines(slice), cosines(usual)));
    }
    if (0..2).any(|a| (slice.spacing[a] - usual.spacing[a]).abs() > SAME * usual.spacing[a].abs()) {
        return Some(format!("pixels of {:?} mm instead of {:?}", slice.spacing, usual.spacing));
    }
    (slice.frame_of_reference != usual.frame_of_reference).then(|| "another frame of reference".into())
}

/// The step from slice to slice, mm; the slices are sorted along the normal.
fn stacking(folder: &Path, slices: &[Slice], normal: &Vec3) -> Result<Vec3, IoError> {
    let at = |k: usize| slices[k].origin.dot(normal);
    let gaps: Vec<f64> = (1..slices.len()).map(|k| at(k) - at(k - 1)).collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    let (least, most) = (sorted[0], sorted[sorted.len() - 1]);
    let uneven = |g: f64| (g - usual).abs() > UNEVEN * usual;
    if let Some(k) = gaps.iter().position(|&g| g <= UNEVEN * usual) {
        let (one, other) = (name(&slices[k].path), name(&slices[k + 1].path));
        let found = format!("two slices at {:.2} mm along the normal: {one} and {other}", at(k));
        return Err(IoError::unsupported(folder, found, "leave one acquisition in the folder"));
    }
    if least < (1.0 - UNEVEN) * usual {
        return Err(IoError::Spacing { path: folder.into(), least_mm: least, most_mm: most });
    }
    if let Some(hole) = gaps.iter().position(|&g| uneven(g)) {
        let times = gaps.iter().map(|g| g / usual);
        if times.clone().any(|t| (t - t.round()).abs() > UNEVEN * t.round()) {
            return Err(IoError::Spacing { path: folder.into(), least_mm: least, most_mm: most });
        }
        let missing = times.map(|t| t.round() as usize - 1).sum();
        let (after_mm, before_mm) = (at(hole), at(hole + 1));
        return Err(IoError::MissingSlices { path: folder.into(), missing, after_mm, before_mm, spacing_mm: usual });
    }
    let step = (slices[slices.len() - 1].origin - slices[0].origin) / gaps.len() as f64;
    let along = step.dot(normal);
    let sideways = (step - normal * along).norm();
    if sideways > TILT * along {
        return Err(IoError::GantryTilt { path: folder.into(), degrees: (sideways / along).atan().to_degrees() });
    }
    Ok(normal * along)
}

/// Tells of attributes that contradict the positions, which count.
fn headers_agree(slices: &[Slice], normal: &Vec3, step: f64, told: &mut Vec<String>) {
    let unlike = |b: &f64| *b != 0.0 && (b.abs() - step).abs() > UNEVEN * step;
    if let Some(between) = slices.iter().filter_map(|s| s.between).find(unlike) {
        told.push(format!(
            "slices are {step:.4} mm apart by their positions and {between} by Spacing Between Slices (0018,0088): the \
             positions count"
        ));
    }
    let upright = normal.amax() > 1.0 - SAME;
    if let Some(tilt) = slices.iter().filter_map(|s| s.tilt).find(|t| t.abs() > TILTED && upright) {
        told.push(format!(
            "the gantry was tilted by {tilt} degrees (0018,1120), which neither orientation nor positions show: resampled, \
             or the places are wrong"
        ));
    }
}
