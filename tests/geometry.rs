//! Geometry and io: shapes in, meshes out, and back again.
mod geometry {
    mod anatomy;
    mod bake;
    mod bake_command;
    mod block;
    mod ct_files;
    mod dicom_files;
    mod distance;
    mod foreign_meshes;
    mod head;
    mod heads;
    mod marching_cubes;
    mod mesh_files;
    mod nifti_files;
    mod noise;
    mod nrrd_files;
    mod phantom;
    mod storage;
    mod stuffing;
}
