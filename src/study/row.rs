//! A line of the table, and its way into a file and back.

use super::Answer;

/// How far an answer is from the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Root of the mean square over the vertices of the skin, m: the largest of all instants.
    pub rms: f64,
    /// The 95th percentile, m.
    pub p95: f64,
    /// The largest, m.
    pub max: f64,
    /// Largest difference of a bone's reaction force, in units of the largest reaction of the reference.
    pub force: f64,
}

/// One variant, measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the variant.
    pub name: String,
    /// What came out, or why nothing did.
    pub outcome: Result<Measured, String>,
}

/// The numbers of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Errors against the reference.
    pub errors: Reading,
    /// Scalar unknowns.
    pub n_dofs: usize,
    /// Linear solves of a step.
    pub solves: f64,
    /// CPU seconds of a step.
    pub step: f64,
    /// CPU seconds before the first step.
    pub setup: f64,
    /// Bytes of matrices, factor and solver.
    pub memory: usize,
}

impl Row {
    /// The row of an answer.
    pub fn new(name: String, found: Result<Answer, String>, reference: &Answer) -> Row {
        let measured = |a: Answer| Measured {
            errors: errors(&a, reference),
            n_dofs: a.n_dofs,
            solves: a.solves,
            step: a.step,
            setup: a.setup,
            memory: a.memory,
        };
        Row { name, outcome: found.map(measured) }
    }
}

/// Errors of one answer against another at the same instants and vertices.
pub fn errors(answer: &Answer, reference: &Answer) -> Reading {
    let per_instant = (reference.u.len() / reference.instants.max(1)).max(3);
    let mut out = Reading { rms: 0.0, p95: 0.0, max: 0.0, force: 0.0 };
    for (u, v) in answer.u.chunks(per_instant).zip(reference.u.chunks(per_instant)) {
        let apart = |(u, v): (&[f64; 3], &[f64; 3])| u.iter().zip(v).map(|(u, v)| (u - v).powi(2)).sum::<f64>().sqrt();
        let mut off: Vec<f64> = u.as_chunks().0.iter().zip(v.as_chunks().0).map(apart).collect();
        off.sort_by(f64::total_cmp);
        let mean = off.iter().map(|d| d * d).sum::<f64>() / off.len().max(1) as f64;
        out.rms = out.rms.max(mean.sqrt());
        out.p95 = out.p95.max(off.get(off.len() * 95 / 100).copied().unwrap_or(0.0));
        out.max = out.max.max(off.last().copied().unwrap_or(0.0));
    }
    let size = |f: &[f64]| {
        f.as_chunks::<3>().0.iter().map(|f| f.iter().map(|f| f * f).sum::<f64>().sqrt()).fold(0.0, f64::max)
    };
    let apart: Vec<f64> = answer.reaction.iter().zip(&reference.reaction).map(|(a, b)| a - b).collect();
    out.force = size(&apart) / size(&reference.reaction).max(f64::MIN_POSITIVE);
    out
}

const HEADER: &str = "variant,unknowns,solves,step_ms,setup_s,memory_MB,rms_mm,p95_mm,max_mm,force_error,why_not";

/// The rows as a table of comma-separated values; `identity` says which study they are of.
pub fn write_rows(identity: &str, rows: &[Row]) -> String {
    let mut out = format!("# {identity}\n{HEADER}\n");
    for row in rows {
        let name = row.name.replace('"', "'");
        out += &match &row.outcome {
            Ok(m) => format!(
                "\"{name}\",{},{},{},{},{},{},{},{},{},\n",
                m.n_dofs,
                m.solves,
                1e3 * m.step,
                m.setup,
                1e-6 * m.memory as f64,
                1e3 * m.errors.rms,
                1e3 * m.errors.p95,
                1e3 * m.errors.max,
                m.errors.force
            ),
            Err(why) => {
                let why = why.replace(['"', '\n'], "'");
                format!("\"{name}\",,,,,,,,,,\"{why}\"\n")
            }
        };
    }
    out
}

/// Reads what [`write_rows`] wrote; nothing of another study.
pub fn read_rows(identity: &str, text: &str) -> Vec<Row> {
    let mut lines = text.lines();
    if lines.next() != Some(&format!("# {identity}")) || lines.next() != Some(HEADER) {
        return Vec::new();
    }
    lines.filter_map(read_row).collect()
}

fn read_row(line: &str) -> Option<Row> {
    let (name, rest) = line.strip_prefix('"')?.split_once("\",")?;
    let name = name.to_owned();
    if let Some(why) = rest.strip_prefix(",,,,,,,,,") {
        return Some(Row { name, outcome: Err(why.trim_matches('"').to_owned()) });
    }
    let v: Vec<f64> = rest.trim_end_matches(',').split(',').map(str::parse).collect::<Result<_, _>>().ok()?;
    let [n_dofs, solves, step, setup, memory, rms, p95, max, force] = v[..].try_into().ok()?;
    let errors = Reading { rms: 1e-3 * rms, p95: 1e-3 * p95, max: 1e-3 * max, force };
    let (n_dofs, memory) = (n_dofs as usize, (1e6 * memory).round() as usize);
    Some(Row { name, outcome: Ok(Measured { errors, n_dofs, solves, step: 1e-3 * step, setup, memory }) })
}
