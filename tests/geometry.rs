//! Geometry and io: shapes in, meshes out, and back again.
mod geometry {
    mod bake;
    mod block;
    mod ct_files;
    mod distance;
    mod head;
    mod marching_cubes;
    mod mesh_files;
    mod noise;
    mod stuffing;
}
