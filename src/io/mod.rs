//! Files in and out: meshes, results for viewers, baked models, CT volumes. The only room that reads the file system.
#![forbid(unsafe_code)]

mod baked;
mod ct;
mod dicom;
mod error;
mod file;
mod foreign;
mod gmsh;
mod gzip;
mod labels;
mod mesh;
mod nifti;
mod nifti_labels;
mod nrrd;
mod nrrd_files;
mod text;
mod vtk;

pub use baked::{decode, encode};
pub use ct::{read_labels, read_volume};
pub use error::IoError;
pub use file::{Growing, create_folder, read_bytes, read_text, remove_file, remove_files, rename, write_bytes};
pub use labels::LabelMap;
pub use mesh::{check_mesh_target, read_mesh, read_surface, write_mesh};
pub use nifti_labels::{check_labels_target, write_labels};
pub use vtk::{Data, write_pvd, write_vtp, write_vtu};
