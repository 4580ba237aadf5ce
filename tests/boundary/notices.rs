//! The license texts of the crates inside the library: what is checked in is what their packages say.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use super::util::{compare, root};

/// A license text as it was first met, and `name vVERSION` of each crate under it with the copyright lines of its package.
type Text = (String, BTreeMap<String, Vec<String>>);

#[test]
fn the_notices_of_the_libraries_are_up_to_date() {
    let list = std::fs::read_to_string(root().join("fmu/third-party.txt")).unwrap();
    let metadata = metadata();
    // By the words alone: packages break the lines of one text in many places.
    let mut texts: BTreeMap<String, Text> = BTreeMap::new();
    let mut silent = String::new();
    for line in list.lines() {
        let (id, license) = line.split_once(": ").unwrap();
        let package = metadata.iter().find(|p| format!("{} v{}", text(&p["name"]), text(&p["version"])) == id);
        let package = package.unwrap_or_else(|| panic!("cargo knows no {id}, which fmu/third-party.txt lists"));
        let files = license_files(Path::new(text(&package["manifest_path"])).parent().unwrap(), license);
        if files.is_empty() {
            let authors: Vec<&str> = package["authors"].as_array().unwrap().iter().map(text).collect();
            let authors = if authors.is_empty() { "its authors".to_owned() } else { authors.join(", ") };
            writeln!(silent, "{id}, by {authors}: {license}").unwrap();
        }
        for file in files {
            let (holders, body) = split(&file);
            let words: Vec<&str> = body.split_whitespace().collect();
            let (_, crates) = texts.entry(words.join(" ")).or_insert((body, BTreeMap::new()));
            crates.entry(id.to_owned()).or_default().extend(holders);
        }
    }
    assert!(texts.keys().any(|words| words.contains("Permission is hereby granted")), "no license text was found");

    let mut out = String::from(
        "Licenses and notices of the libraries inside cutis, as their packages carry them. Where a library may be had under\n\
         several licenses and MIT is one, it is taken under MIT. Copyright lines stand before the text that they belong to.\n",
    );
    let mut texts: Vec<Text> = texts.into_values().collect();
    texts.sort_by(|(_, a), (_, b)| (b.len(), a.keys().next()).cmp(&(a.len(), b.keys().next())));
    for (body, crates) in texts {
        writeln!(out, "\n{}\n", "=".repeat(80)).unwrap();
        for (id, holders) in crates {
            writeln!(out, "{id}").unwrap();
            holders.iter().for_each(|holder| writeln!(out, "    {holder}").unwrap());
        }
        writeln!(out, "\n{body}").unwrap();
    }
    writeln!(out, "\n{}\n\nThese packages name a license and carry no text:\n\n{silent}", "=".repeat(80)).unwrap();
    compare("fmu/third-party-notices.txt", out.trim_end_matches('\n'));
}

fn metadata() -> Vec<serde_json::Value> {
    let arguments =
        "metadata --offline --locked --format-version 1 --filter-platform x86_64-unknown-linux-gnu".split(' ');
    let output = Command::new(env!("CARGO")).args(arguments).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut all: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    all["packages"].as_array_mut().map(std::mem::take).unwrap()
}

fn text(value: &serde_json::Value) -> &str {
    value.as_str().unwrap()
}

/// License files of a package: those of MIT where it is a choice, else all; what it took from others in any case.
fn license_files(folder: &Path, license: &str) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| entry.ok().filter(|e| e.path().is_file())?.file_name().into_string().ok())
        .filter(|name| {
            let name = name.to_lowercase();
            ["license", "licence", "copying", "unlicense", "notice"].iter().any(|start| name.starts_with(start))
        })
        .collect();
    names.sort_unstable();
    let is_mit = |name: &String| name.to_lowercase().ends_with("mit") || name.to_lowercase().ends_with("mit.md");
    if license.contains("MIT") && names.iter().any(is_mit) {
        names.retain(|name| is_mit(name) || name.starts_with("COPYING.") || name.starts_with("NOTICE"));
    }
    names.iter().map(|name| String::from_utf8_lossy(&std::fs::read(folder.join(name)).unwrap()).into_owned()).collect()
}

/// Copyright lines that stand before the text, and the text without them and without spaces at ends of lines.
fn split(file: &str) -> (Vec<String>, String) {
    let mut lines = file.lines().map(|line| line.trim_end().trim_start_matches('\u{feff}')).peekable();
    let (mut holders, mut head) = (Vec::new(), Vec::new());
    while let Some(line) = lines.next_if(|line| !line.starts_with("Permission is hereby granted")) {
        if line.trim_start().to_lowercase().starts_with("copyright") {
            holders.push(line.trim().to_owned());
        } else if !line.is_empty() {
            head.push(line);
        }
    }
    if lines.peek().is_none() {
        // No such sentence: another license, kept as it is.
        let whole: Vec<&str> = file.lines().map(str::trim_end).collect();
        return (Vec::new(), whole.join("\n").trim_matches('\n').to_owned());
    }
    let body: Vec<&str> = lines.collect();
    let title_only = head.iter().all(|line| {
        let line = line.trim_matches(|c: char| !c.is_alphanumeric()).to_lowercase();
        line == "mit license" || line.starts_with("the mit license")
    });
    if !title_only {
        holders.extend(head.iter().map(|line| line.trim().to_owned()));
    }
    (holders, body.join("\n").trim_matches('\n').to_owned())
}
