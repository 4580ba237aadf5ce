//! Geometry and io: shapes in, meshes out, and back again.
mod geometry {
    mod block;
    mod ct_files;
    mod mesh_files;
}
