//! A triangle surface as `.vtp`, in text: the skin, the shapes of contacts.

use std::fmt::Write;

use quick_xml::escape::escape;

use super::Data;
use crate::math::Vec3;

/// The file's text.
pub(crate) fn vtp_text(vertices: &[Vec3], triangles: &[[u32; 3]], point_data: &[Data]) -> String {
    let mut out = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n\
         <Points>\n<DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">\n",
        vertices.len(),
        triangles.len()
    );
    for x in vertices {
        let _ = writeln!(out, "{:e} {:e} {:e}", x.x, x.y, x.z);
    }
    out += "</DataArray>\n</Points>\n<PointData>\n";
    for data in point_data {
        let Data { name, components, values } = data;
        assert_eq!(values.len(), vertices.len() * components, "field `{name}` has another length than the surface");
        let name = escape(*name);
        let _ = writeln!(
            out,
            "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
        );
        for value in *values {
            let _ = writeln!(out, "{value:e}");
        }
        out += "</DataArray>\n";
    }
    out += "</PointData>\n<Polys>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">\n";
    for [a, b, c] in triangles {
        let _ = writeln!(out, "{a} {b} {c}");
    }
    out += "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n";
    for k in 1..=triangles.len() {
        let _ = writeln!(out, "{}", 3 * k);
    }
    out + "</DataArray>\n</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n"
}
