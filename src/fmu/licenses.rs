//! Licenses of everything inside the library: listed, as SPDX, in full.

use std::fmt::Write;

/// The crates inside the library, one a line: `name vVERSION: LICENSE`.
pub(super) const LIST: &str = include_str!("../../fmu/third-party.txt");

/// Their texts and copyright lines.
pub(super) const NOTICES: &str = include_str!("../../fmu/third-party-notices.txt");

/// The list as an SPDX 2.3 document in its tag-value form; `token` makes its name unique.
pub(super) fn spdx(token: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let mut out = format!(
        "SPDXVersion: SPDX-2.3\nDataLicense: CC0-1.0\nSPDXID: SPDXRef-DOCUMENT\nDocumentName: cutis-{version}\n\
         DocumentNamespace: urn:uuid:{}\nCreator: Tool: cutis-{version}\nCreated: 1980-01-01T00:00:00Z\n\
         Relationship: SPDXRef-DOCUMENT DESCRIBES SPDXRef-cutis\n",
        token.trim_matches(['{', '}'])
    );
    package(&mut out, "cutis", "cutis", version, env!("CARGO_PKG_LICENSE"));
    for line in LIST.lines() {
        let Some((name, version, license)) = parse(line) else { continue };
        let id = format!("{name}-{version}").replace(|c: char| !c.is_ascii_alphanumeric() && c != '.', "-");
        package(&mut out, &id, name, version, &expression(license));
        let _ = writeln!(out, "Relationship: SPDXRef-cutis CONTAINS SPDXRef-{id}");
    }
    out
}

fn parse(line: &str) -> Option<(&str, &str, &str)> {
    let (package, license) = line.split_once(": ")?;
    let (name, version) = package.split_once(" v")?;
    Some((name, version, license))
}

/// Old manifests separate alternatives by a slash.
fn expression(license: &str) -> String {
    if license == "see its source" { "NOASSERTION".to_owned() } else { license.replace('/', " OR ") }
}

fn package(out: &mut String, id: &str, name: &str, version: &str, license: &str) {
    let _ = write!(
        out,
        "\nPackageName: {name}\nSPDXID: SPDXRef-{id}\nPackageVersion: {version}\nPackageDownloadLocation: NOASSERTION\n\
         FilesAnalyzed: false\nPackageLicenseConcluded: NOASSERTION\nPackageLicenseDeclared: {license}\n\
         PackageCopyrightText: NOASSERTION\n"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_becomes_a_package_with_a_license() {
        let spdx = spdx("{0}");
        assert_eq!(spdx.matches("PackageName: ").count(), LIST.lines().count() + 1);
        assert!(LIST.lines().all(|line| parse(line).is_some()));
        assert!(!spdx.contains("PackageLicenseDeclared: NOASSERTION") && !spdx.contains("MIT/"));
        let mut ids: Vec<&str> = spdx.lines().filter_map(|l| l.strip_prefix("SPDXID: ")).collect();
        let n = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), n, "identifiers are unique");
    }
}
