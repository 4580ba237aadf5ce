//! From spans of the text to messages with line and column; ranges come from `keys`.

use toml::Spanned;

use super::SceneError;
use super::file::Triple;
use super::keys::{Range, find};
use crate::math::Vec3;
use crate::mesh::SKIN;

/// The text of a scene.
#[derive(Clone, Copy)]
pub struct Text<'a>(pub &'a str);

impl Text<'_> {
    pub fn at(&self, byte: usize, message: String) -> SceneError {
        let before = &self.0[..byte.min(self.0.len())];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        SceneError::Meaning { line, column, message }
    }

    pub fn unknown<'a>(
        &self,
        what: &str,
        found: &Spanned<String>,
        choices: impl Iterator<Item = &'a str>,
    ) -> SceneError {
        let choices: Vec<String> = choices.map(|c| format!("`{c}`")).collect();
        let choices =
            if choices.is_empty() { "there is none".to_owned() } else { format!("expected {}", choices.join(", ")) };
        self.at(found.span().start, format!("unknown {what} `{}`, {choices}", found.get_ref()))
    }

    pub fn no_skin(&self, name: &Spanned<String>) -> SceneError {
        let message = format!("`{}` needs a place on the skin, but the mesh has no face set `{SKIN}`", name.get_ref());
        self.at(name.span().start, message)
    }

    pub fn out_of_range<T>(
        &self,
        table: &str,
        name: &str,
        at: &Spanned<T>,
        found: &dyn std::fmt::Display,
    ) -> SceneError {
        let key = find(table, name);
        let wanted = if key.range == Range::Any { "a finite number".to_owned() } else { key.range.to_string() };
        let unit = if key.unit.is_empty() { String::new() } else { format!(" {}", key.unit) };
        self.at(at.span().start, format!("`{name}` of [{table}] is {found}{unit}; wanted {wanted}"))
    }

    pub fn checked(&self, table: &str, name: &str, value: &Spanned<f64>) -> Result<f64, SceneError> {
        let v = *value.get_ref();
        if find(table, name).range.holds(v) { Ok(v) } else { Err(self.out_of_range(table, name, value, &v)) }
    }

    pub fn count(&self, table: &str, name: &str, value: &Spanned<u32>) -> Result<u32, SceneError> {
        let n = *value.get_ref();
        if find(table, name).range.holds(n.into()) { Ok(n) } else { Err(self.out_of_range(table, name, value, &n)) }
    }

    pub fn number(&self, table: &str, name: &str, value: &Option<Spanned<f64>>) -> Result<Option<f64>, SceneError> {
        value.as_ref().map(|v| self.checked(table, name, v)).transpose()
    }

    pub fn all_in_range(&self, table: &str, name: &str, values: &Spanned<Vec<f64>>) -> Result<(), SceneError> {
        match values.get_ref().iter().find(|v| !find(table, name).range.holds(**v)) {
            Some(bad) => Err(self.out_of_range(table, name, values, bad)),
            None => Ok(()),
        }
    }

    pub fn triple(&self, table: &str, name: &str, value: &Option<Triple>) -> Result<Option<[f64; 3]>, SceneError> {
        value.as_ref().map(|v| self.vector(table, name, v).map(Into::into)).transpose()
    }

    pub fn vector(&self, table: &str, name: &str, value: &Triple) -> Result<Vec3, SceneError> {
        let range = find(table, name).range;
        match value.get_ref().iter().find(|c| !range.holds(**c)) {
            Some(c) => Err(self.out_of_range(table, name, value, c)),
            None => Ok(Vec3::from(*value.get_ref())),
        }
    }

    pub fn choice(
        &self,
        table: &str,
        name: &str,
        value: &Option<Spanned<String>>,
    ) -> Result<Option<&'static str>, SceneError> {
        let Some(value) = value else { return Ok(None) };
        let Range::OneOf(choices) = find(table, name).range else { return Ok(None) };
        let found = choices.iter().find(|c| *c == value.get_ref());
        found.map(|c| Some(*c)).ok_or_else(|| self.unknown(&format!("`{name}`"), value, choices.iter().copied()))
    }

    /// The names, each once, none empty.
    pub fn names<'a>(
        &self,
        table: &str,
        names: impl Iterator<Item = &'a Spanned<String>>,
    ) -> Result<Vec<String>, SceneError> {
        let mut out: Vec<String> = Vec::new();
        for name in names {
            let text = name.get_ref();
            if text.is_empty() || !text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
                let message = format!("`{text}` is no name for a [[{table}]]: use letters, digits and _");
                return Err(self.at(name.span().start, message));
            }
            if out.contains(text) {
                return Err(self.at(name.span().start, format!("two [[{table}]] are named `{text}`")));
            }
            out.push(text.clone());
        }
        Ok(out)
    }
}
