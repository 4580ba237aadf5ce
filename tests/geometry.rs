//! Geometry and io: shapes in, meshes out, and back again.
mod geometry {
    mod block;
    mod mesh_files;
}
