//! Tissues by name: the data file of presets, and how a scene's own keys take precedence.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use super::SceneError;
use super::build::Builder;
use super::file::TissueSpec;

/// A tissue of the data file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    /// What it is, where it is found.
    pub doc: String,
    /// Where the numbers come from.
    pub source: String,
    /// The typical tissue.
    pub tissue: TissueSpec,
    /// What differs at the low end of the range.
    pub low: Option<TissueSpec>,
    /// What differs at the high end.
    pub high: Option<TissueSpec>,
}

/// All presets, by name.
pub fn presets() -> &'static BTreeMap<String, Preset> {
    static PRESETS: LazyLock<BTreeMap<String, Preset>> =
        LazyLock::new(|| toml::from_str(include_str!("presets.toml")).expect("a test reads the presets"));
    &PRESETS
}

impl Builder<'_> {
    /// `spec` with what its preset fills in.
    pub(super) fn with_preset(&self, spec: &TissueSpec) -> Result<TissueSpec, SceneError> {
        let level = self.text.choice("tissue", "level", &spec.level)?;
        let Some(name) = &spec.preset else {
            return match &spec.level {
                Some(level) => Err(self.text.at(level.span().start, "`level` needs a `preset`".to_owned())),
                None => Ok(spec.clone()),
            };
        };
        let preset = presets().get(name.get_ref());
        let preset = preset.ok_or_else(|| self.text.unknown("`preset`", name, presets().keys().map(String::as_str)))?;
        let end = match level {
            Some("low") => preset.low.as_ref(),
            Some("high") => preset.high.as_ref(),
            _ => Some(&preset.tissue),
        };
        let Some(end) = end else {
            let message = format!("preset `{}` has one level only", name.get_ref());
            return Err(self.text.at(spec.level.as_ref().unwrap_or(name).span().start, message));
        };
        let mut filled = preset.tissue.clone();
        overlay(&mut filled, end);
        if spec.energy.is_some() {
            // Another law has other constants.
            filled = TissueSpec { density: filled.density, viscous: filled.viscous, ..TissueSpec::default() };
        }
        overlay(&mut filled, spec);
        Ok(filled)
    }
}

/// Puts what `over` says over `under`.
fn overlay(under: &mut TissueSpec, over: &TissueSpec) {
    macro_rules! take {
        ($($field:ident)*) => {
            // Exhaustive, so that a new key cannot be forgotten here.
            let TissueSpec { $($field),* } = over;
            $(if $field.is_some() { under.$field = $field.clone(); })*
        };
    }
    take!(regions preset level energy E nu mu alpha b c1 c2 c10 c01 c20 c30 kappa density pressure viscous fibre damage
          grade limit tension tunable);
}

/// The presets as a Markdown table.
pub fn preset_reference() -> String {
    let mut out = String::from(
        "## Presets\n\n`preset = \"fat\"` in a `[[tissue]]`, with `level`; `cutis presets` prints them, `src/scene/presets.toml` holds them.\n\n\
         | preset | tissue | law | low | typical | high | source |\n| --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (name, p) in presets() {
        let law = p.tissue.energy.as_ref().map_or("", |e| e.get_ref());
        let column = |t: &Option<TissueSpec>| t.as_ref().map_or(String::new(), constants);
        out += &format!(
            "| `{name}` | {} | `{law}` | {} | {} | {} | {} |\n",
            p.doc,
            column(&p.low),
            constants(&p.tissue),
            column(&p.high),
            p.source
        );
    }
    out
}

/// The constants of a tissue in a line.
fn constants(tissue: &TissueSpec) -> String {
    let given = tissue.constants().into_iter().filter_map(|(key, value)| {
        let values = value.as_ref()?.get_ref().values();
        Some(format!("{key} {}", values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(", ")))
    });
    given.collect::<Vec<_>>().join(", ")
}
