//! `.vtu` in full precision: raw appended arrays behind an XML head.

use quick_xml::escape::escape;

use super::Data;
use super::grid::{Array, VTK_TETRA, Values, tags};
use crate::math::Vec3;
use crate::mesh::TetMesh;

/// The bytes of a `.vtu` file.
pub(crate) fn vtu_bytes(mesh: &TetMesh, x: &[Vec3], point_data: &[Data], cell_data: &[Data]) -> Vec<u8> {
    assert_eq!(x.len(), mesh.nodes.len(), "one position a node");
    let (n_nodes, n_tets) = (mesh.nodes.len(), mesh.tets.len());
    let [mut point, mut cell, field] = tags(mesh);
    point.extend(point_data.iter().map(|d| given(d, n_nodes)));
    cell.extend(cell_data.iter().map(|d| given(d, n_tets)));
    let mut out = Appender::default();
    out.head += "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n<FieldData>\n";
    field.iter().for_each(|a| out.array(a, true));
    out.head += &format!("</FieldData>\n<Piece NumberOfPoints=\"{n_nodes}\" NumberOfCells=\"{n_tets}\">\n");
    out.group("PointData", &point);
    out.group("CellData", &cell);
    let coordinates = Values::F64(x.iter().flat_map(|x| [x.x, x.y, x.z]).collect());
    out.group("Points", &[Array::new("Points", 3, coordinates)]);
    let connectivity = mesh.tets.as_flattened().iter().map(|&a| i64::from(a)).collect();
    let offsets = (1..=n_tets as i64).map(|e| 4 * e).collect();
    let cells = [
        Array::new("connectivity", 1, Values::I64(connectivity)),
        Array::new("offsets", 1, Values::I64(offsets)),
        Array::new("types", 1, Values::I8(vec![VTK_TETRA as i8; n_tets])),
    ];
    out.group("Cells", &cells);
    out.head += "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    let mut bytes = out.head.into_bytes();
    bytes.extend(out.appended);
    bytes.extend(b"\n</AppendedData>\n</VTKFile>\n");
    bytes
}

fn given(data: &Data, n: usize) -> Array {
    assert_eq!(data.values.len(), n * data.components, "field `{}` has another length than the mesh", data.name);
    Array::new(data.name, data.components, Values::F64(data.values.to_vec()))
}

#[derive(Default)]
struct Appender {
    head: String,
    appended: Vec<u8>,
}

impl Appender {
    fn group(&mut self, tag: &str, arrays: &[Array]) {
        self.head += &format!("<{tag}>\n");
        arrays.iter().for_each(|a| self.array(a, false));
        self.head += &format!("</{tag}>\n");
    }

    fn array(&mut self, array: &Array, tuples: bool) {
        let name = escape(array.name.as_str());
        let (kind, bytes): (&str, Vec<u8>) = match &array.values {
            Values::F64(v) => ("Float64", v.iter().flat_map(|x| x.to_le_bytes()).collect()),
            Values::I64(v) => ("Int64", v.iter().flat_map(|x| x.to_le_bytes()).collect()),
            Values::I8(v) => {
                (if array.name == "types" { "UInt8" } else { "Int8" }, v.iter().map(|&x| x as u8).collect())
            }
            // Character codes, not VTK's string arrays: those stop readers that know numbers only.
            Values::Text(words) => ("UInt8", words.iter().flat_map(|w| w.bytes().chain([0])).collect()),
        };
        let count = match &array.values {
            Values::F64(v) => v.len(),
            Values::I64(v) => v.len(),
            _ => bytes.len(),
        };
        let components = array.components;
        let rows = if tuples { format!(" NumberOfTuples=\"{}\"", count / components.max(1)) } else { String::new() };
        let offset = self.appended.len();
        self.head += &format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"{rows} format=\"appended\" offset=\"{offset}\"/>\n"
        );
        self.appended.extend((bytes.len() as u64).to_le_bytes());
        self.appended.extend(bytes);
    }
}
