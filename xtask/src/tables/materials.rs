//! Tables of the material library.

use super::{markdown, number};
use crate::{Outcome, process, root};

/// The constants of the material library, one column for each material.
pub fn constants() -> Outcome<String> {
    let library = library()?;
    let mut rows = vec![vec!["constant".to_string()]];
    for material in &library {
        rows[0].push(material["name"].as_str().unwrap_or_default().to_string());
    }
    for group in GROUPS {
        let mut constants: Vec<&String> = Vec::new();
        for material in &library {
            let table = material.get(group).and_then(toml::Value::as_table);
            constants.extend(table.into_iter().flat_map(toml::Table::keys).filter(|key| *key != "source"));
        }
        constants.sort();
        constants.dedup();
        for constant in constants {
            let mut row = vec![format!("`{constant}`")];
            row.extend(library.iter().map(
                |material| match material.get(group).and_then(|g| g.get(constant)) {
                    Some(toml::Value::Float(value)) => number(*value),
                    Some(other) => other.to_string(),
                    None => "-".into(),
                },
            ));
            rows.push(row);
        }
    }
    Ok(markdown(&rows))
}

/// Where the constants of the material library come from.
pub fn sources() -> Outcome<String> {
    let mut rows = vec![["material", "group", "source"].map(str::to_string).to_vec()];
    for material in &library()? {
        for group in GROUPS {
            if let Some(source) =
                material.get(group).and_then(|g| g.get("source")).and_then(toml::Value::as_str)
            {
                let name = material["name"].as_str().unwrap_or_default();
                rows.push(vec![name.into(), group.into(), source.into()]);
            }
        }
    }
    Ok(markdown(&rows))
}

/// Groups of constants in the library.
const GROUPS: [&str; 6] = ["elastic", "flow", "thermal", "damage", "tanh", "zerilli_armstrong"];

fn library() -> Outcome<Vec<toml::Table>> {
    let text = process::read(&root().join("resources/materials.toml"))?;
    let all: toml::Table = toml::from_str(&text).map_err(|e| format!("materials.toml: {e}"))?;
    let list =
        all.get("material").and_then(toml::Value::as_array).ok_or("materials.toml has no materials")?;
    Ok(list.iter().filter_map(|material| material.as_table().cloned()).collect())
}
