//! Tables of the README and the book: made from result files, the model description and the material library.
//!
//! A result file holds comma-separated values in `results/` (and `resources/price_list.csv`) with a head:
//!
//! ```text
//! # title: what was measured
//! # command: what measures it
//! # commit: …      # processor: …      # date: …      # note: (where there is one)
//! ```

mod materials;

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::{Outcome, process, root};

/// Entries that every head has.
pub const HEAD: [&str; 5] = ["title", "command", "commit", "processor", "date"];

/// A result file in memory.
pub struct Measured {
    /// Names and values of the head's lines.
    pub head: Vec<(String, String)>,
    /// The head of the table and its rows, all of one width.
    pub rows: Vec<Vec<String>>,
}

impl Measured {
    /// Reads a result file.
    ///
    /// # Errors
    /// A head that lacks an entry, or rows of different widths.
    pub fn read(name: &str) -> Outcome<Measured> {
        let path = path_of(name);
        Measured::parse(&process::read(&path)?).map_err(|text| format!("'{}': {text}", path.display()))
    }

    fn parse(text: &str) -> Outcome<Measured> {
        let (remarks, lines): (Vec<&str>, Vec<&str>) =
            text.lines().filter(|line| !line.is_empty()).partition(|line| line.starts_with('#'));
        let entry = |line: &&str| {
            let (name, value) = line.trim_start_matches('#').split_once(": ")?;
            Some((name.trim().to_string(), value.trim().to_string()))
        };
        let head: Vec<(String, String)> = remarks.iter().filter_map(entry).collect();
        if let Some(missing) = HEAD.iter().find(|name| !head.iter().any(|(known, _)| known == *name)) {
            return Err(format!("the head has no line '# {missing}: …'"));
        }
        let rows: Vec<Vec<String>> = lines.iter().map(|line| cells(line)).collect();
        let width = rows.first().ok_or("there is no table")?.len();
        match rows.iter().find(|row| row.len() != width) {
            Some(row) => Err(format!("{} cells instead of {width} in '{}'", row.len(), row.join(","))),
            None => Ok(Measured { head, rows }),
        }
    }

    /// An entry of the head.
    pub fn entry(&self, name: &str) -> &str {
        self.head.iter().find(|(known, _)| known == name).map_or("", |(_, value)| value)
    }

    /// The file's text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.head {
            let _ = writeln!(text, "# {name}: {value}");
        }
        for row in &self.rows {
            let _ = writeln!(text, "{}", row.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(","));
        }
        text
    }
}

/// Where a result file lies.
pub fn path_of(name: &str) -> PathBuf {
    let folder = if name == "price_list" { "resources" } else { "results" };
    root().join(folder).join(format!("{name}.csv"))
}

/// The names of all result files.
///
/// # Errors
/// A folder that cannot be read.
pub fn names() -> Outcome<Vec<String>> {
    let folder = root().join("results");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("'{}': {e}", folder.display()))?;
    let mut names: Vec<String> = entries
        .filter_map(|entry| {
            entry.ok()?.file_name().into_string().ok()?.strip_suffix(".csv").map(str::to_string)
        })
        .collect();
    names.push("price_list".into());
    names.sort();
    Ok(names)
}

/// The cells of a line of comma-separated values; quotes hold commas, two of them one.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => cell.extend(letters.next()),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(std::mem::take(&mut cell)),
            other => cell.push(other),
        }
    }
    cells.push(cell);
    cells
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_string() }
}

/// The table of a mark's name, in Markdown.
///
/// # Errors
/// A name that no file and no rule gives a table for, or files that cannot be read.
pub fn table(name: &str, place: Place) -> Outcome<String> {
    match name {
        "presets" => presets(place, false),
        "price-list" => presets(place, true),
        "heads" => heads(),
        "materials" => materials::constants(),
        "material-sources" => materials::sources(),
        "instruction-counts" => instruction_counts(),
        "enumerations" => enumerations(),
        "units" => units(),
        "combinations" => combinations(),
        "inputs" => variables("input", None),
        "outputs" => variables("output", None),
        "verification-unmet" => rows_with("verification", "**not met**", place),
        "hard-cases-failed" => rows_with("hard_cases", "**fail**", place),
        _ => match name.strip_prefix("parameters-") {
            Some(group) => variables("parameter", Some(group)),
            None => whole(&name.replace('-', "_"), place),
        },
    }
}

/// Where a table stands, and with it where its source's head is shown.
#[derive(Clone, Copy)]
pub enum Place {
    /// In the README, which links to the files themselves.
    Readme,
    /// In a page of the book, which links to the page of all heads, by a way of its own.
    Book(&'static str),
}

/// A result file as it is.
fn whole(name: &str, place: Place) -> Outcome<String> {
    let measured = Measured::read(name)?;
    Ok(format!("{}\n{}", markdown(&measured.rows), source(name, &measured, place)))
}

/// The rows of a result file that hold a word, and how many rows there are.
fn rows_with(name: &str, word: &str, place: Place) -> Outcome<String> {
    let measured = Measured::read(name)?;
    let (head, all) = measured.rows.split_first().ok_or("there is no table")?;
    let mut rows = vec![head.clone()];
    rows.extend(all.iter().filter(|row| row.iter().any(|cell| cell == word)).cloned());
    let judged =
        all.iter().filter(|row| row.iter().any(|cell| cell == word || cell == "met" || cell == "pass"));
    let count = format!("{} of {} figures with a bound miss it.", rows.len() - 1, judged.count());
    Ok(format!("{count}\n\n{}\n{}", markdown(&rows), source(name, &measured, place)))
}

/// One line on where a table comes from.
fn source(name: &str, measured: &Measured, place: Place) -> String {
    let link = match place {
        Place::Readme => {
            let path = path_of(name);
            let path = path.strip_prefix(root()).unwrap_or(&path).display();
            format!("[{path}]({path})")
        }
        Place::Book(heads) => format!("[{name}]({heads}#{name})"),
    };
    format!("*Source: {link}, {}; `{}`.*\n", measured.entry("title"), measured.entry("command"))
}

/// Rows as a table in Markdown: columns with no value are left out, a case or problem is named once.
pub fn markdown(rows: &[Vec<String>]) -> String {
    let Some((head, body)) = rows.split_first() else { return String::new() };
    let shown: Vec<usize> =
        (0..head.len()).filter(|&k| body.is_empty() || body.iter().any(|row| !row[k].is_empty())).collect();
    let is_grouped = ["case", "problem"].contains(&head[0].as_str());
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    // A percent sign does not leave its number.
    let cell = |text: &str| text.replace('|', "\\|").replace(" %", "\u{a0}%");
    let mut text = line(shown.iter().map(|&k| cell(&head[k])).collect());
    let _ = writeln!(text, "|{}", "---|".repeat(shown.len()));
    let mut last = "";
    for row in body {
        let repeats = is_grouped && row[0] == last;
        let cells = shown.iter().map(|&k| if k == 0 && repeats { String::new() } else { cell(&row[k]) });
        text.push_str(&line(cells.collect()));
        last = &row[0];
    }
    text
}

/// The presets of the price list: the force alone, or with all bands and with conduction.
fn presets(place: Place, is_full: bool) -> Outcome<String> {
    const BANDS: [&str; 5] = ["cutting force", "thrust", "chip thickness", "chip heating", "p99.9 strain"];
    let measured = Measured::read("price_list")?;
    let (feed, description) = (start_of("feed")?, description()?);
    let numbers = items(&description, "Accuracy");
    let number = |name: &str| numbers.iter().find(|item| item.name == name).map_or("-", |item| item.number);
    let mut head = vec!["preset", "number", "points per feed", "spacing (µm)", "CPU time (s)"];
    if is_full {
        head.extend(BANDS)
    } else {
        head.push("error of the cutting force")
    }
    let mut rows = vec![head.into_iter().map(str::to_string).collect::<Vec<_>>()];
    for row in &measured.rows[1..] {
        let Some(heat) = row[0].strip_prefix("preset") else { continue };
        if !is_full && !heat.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> = row[2..].iter().map(|cell| cell.parse().ok()).collect();
        let numbers =
            numbers.ok_or_else(|| format!("price_list.csv: '{}' is no number", row[2..].join(",")))?;
        let mut cells = vec![
            format!("`{}`{heat}", row[1]),
            number(&row[1]).to_string(),
            format!("{}", (10.0 * feed / numbers[0]).round() / 10.0),
            format!("{:.0}", 1e6 * numbers[0]),
            format!("{:.1}", numbers[1]),
        ];
        let most = if is_full { BANDS.len() } else { 1 };
        cells.extend(numbers[2..].iter().take(most).map(|band| format!("±{}", percent(*band))));
        rows.push(cells);
    }
    Ok(format!("{}\n{}", markdown(&rows), source("price_list", &measured, place)))
}

/// A share in percent, with two digits.
fn percent(share: f64) -> String {
    if share < 0.0995 { format!("{:.1} %", 100.0 * share) } else { format!("{:.0} %", 100.0 * share) }
}

/// Each result file with its head; the book's page of sources.
fn heads() -> Outcome<String> {
    let mut text = String::new();
    for name in names()? {
        let measured = Measured::read(&name)?;
        let _ = writeln!(text, "<h3 id=\"{name}\">{name}</h3>\n\n{}\n", measured.entry("title"));
        for (entry, value) in measured.head.iter().filter(|(entry, _)| entry != "title") {
            let value = if entry == "command" { format!("`{value}`") } else { value.clone() };
            let _ = writeln!(text, "- {entry}: {value}");
        }
        text.push('\n');
    }
    Ok(text)
}

/// The committed instruction counts.
fn instruction_counts() -> Outcome<String> {
    let text = process::read(&root().join("tests/data/instruction_counts.toml"))?;
    let all: toml::Table = toml::from_str(&text).map_err(|e| format!("instruction_counts.toml: {e}"))?;
    let counts = all.get("instructions_per_point").and_then(toml::Value::as_table).ok_or("no counts")?;
    let mut rows = vec![["kernel", "instructions per point"].map(str::to_string).to_vec()];
    rows.extend(counts.iter().map(|(name, count)| vec![format!("`{name}`"), count.to_string()]));
    Ok(format!(
        "{}\n*Source: `tests/data/instruction_counts.toml`; `cargo xtask bench --instructions`.*\n",
        markdown(&rows)
    ))
}

fn description() -> Outcome<String> {
    process::read(&root().join("modelDescription/modelDescription.xml"))
}

/// The start value of a Real variable.
fn start_of(name: &str) -> Outcome<f64> {
    let description = description()?;
    let variable = variables_of(&description).find(|v| attribute(v, "name") == Some(name));
    let start = variable.and_then(|v| attribute(v, "start")?.parse().ok());
    start.ok_or_else(|| format!("modelDescription.xml has no start value of {name}"))
}

/// The variables of a causality; of parameters those of a group, the part of the name before its point.
fn variables(causality: &str, group: Option<&str>) -> Outcome<String> {
    let description = description()?;
    let has_start = causality != "output";
    let head: &[&str] =
        if has_start { &["name", "unit", "start", "range", "meaning"] } else { &["name", "unit", "meaning"] };
    let mut rows = vec![head.iter().map(|cell| cell.to_string()).collect::<Vec<_>>()];
    for variable in variables_of(&description).filter(|v| attribute(v, "causality") == Some(causality)) {
        let name = attribute(variable, "name").unwrap_or_default();
        if group.is_none_or(|group| group_of(name) == group) {
            let mut row = vec![format!("`{name}`"), unit(variable)];
            if has_start {
                row.extend(start_and_range(variable, &description));
            }
            row.push(plain(attribute(variable, "description").unwrap_or_default()));
            rows.push(row);
        }
    }
    if rows.len() == 1 {
        return Err(format!("there is no {causality} {}", group.unwrap_or_default()));
    }
    Ok(markdown(&rows))
}

/// The part of a variable's name before its point; `scene` where there is none.
pub fn group_of(name: &str) -> &str {
    name.split_once('.').map_or("scene", |(group, _)| group)
}

/// The variables of a model description, each as the text from its name on.
pub fn variables_of(description: &str) -> impl Iterator<Item = &str> {
    description.split("<ScalarVariable ").skip(1)
}

fn unit(variable: &str) -> String {
    let kinds = ["Integer", "Boolean", "String", "Enumeration"];
    let kind = kinds
        .into_iter()
        .find(|kind| variable.contains(&format!("<{kind} ")) || variable.contains(&format!("<{kind}/>")));
    kind.map_or_else(|| attribute(variable, "unit").unwrap_or_default().to_string(), str::to_string)
}

/// Start value and range; of a choice the items with their numbers.
fn start_and_range(variable: &str, description: &str) -> [String; 2] {
    let of = |name| attribute(variable, name).unwrap_or_default();
    let start = plain(of("start"));
    let items = attribute(variable, "declaredType").map(|name| items(description, name)).unwrap_or_default();
    if !items.is_empty() {
        // What the version refuses is marked in its text.
        let mark = |item: &Item| {
            if item.text.ends_with("(not in this version)") { ", not in this version" } else { "" }
        };
        let all: Vec<String> =
            items.iter().map(|item| format!("{} ({}{})", item.name, item.number, mark(item))).collect();
        let chosen = items.iter().find(|item| item.number == start);
        return [chosen.map_or(start, |item| format!("{} ({})", item.name, item.number)), all.join(", ")];
    }
    if variable.contains("<String ") {
        return [format!("\"{start}\""), String::new()];
    }
    let end = |text: &str| match text.parse::<f64>() {
        Ok(value) if of("unit") == "rad" => format!("{:.0}°", value.to_degrees()),
        Ok(_) => text.to_string(),
        Err(_) => "…".to_string(),
    };
    let range = if of("min").is_empty() && of("max").is_empty() {
        String::new()
    } else {
        format!("{} to {}", end(of("min")), end(of("max")))
    };
    [start, range]
}

/// All enumerations with the numbers that an importer sets.
fn enumerations() -> Outcome<String> {
    let description = description()?;
    let mut rows = vec![["type", "number", "item", "meaning"].map(str::to_string).to_vec()];
    for (name, _) in description.split("<SimpleType name=\"").skip(1).filter_map(|text| text.split_once('"'))
    {
        for item in items(&description, name) {
            rows.push(vec![name.into(), item.number.into(), format!("`{}`", item.name), plain(item.text)]);
        }
    }
    Ok(markdown(&rows))
}

/// Units and the display units that `--set` and importers understand.
fn units() -> Outcome<String> {
    let description = description()?;
    let mut rows = vec![["unit", "also"].map(str::to_string).to_vec()];
    for unit in description.split("<Unit ").skip(1) {
        let body = unit.split("</Unit>").next().unwrap_or_default();
        let others: Vec<&str> =
            body.split("<DisplayUnit ").skip(1).filter_map(|text| attribute(text, "name")).collect();
        if !others.is_empty() {
            rows.push(vec![attribute(unit, "name").unwrap_or_default().into(), others.join(", ")]);
        }
    }
    Ok(markdown(&rows))
}

/// What goes only with what.
fn combinations() -> Outcome<String> {
    let text = process::read(&root().join("resources/combinations.toml"))?;
    let all: toml::Table = toml::from_str(&text).map_err(|e| format!("combinations.toml: {e}"))?;
    let rules = all.get("rule").and_then(toml::Value::as_array).ok_or("combinations.toml has no rules")?;
    let mut rows = vec![["what", "goes only with", "because"].map(str::to_string).to_vec()];
    let condition = |text: &str| {
        let (variable, values) = text.split_once(" = ").unwrap_or((text, ""));
        format!("`{variable}` = {}", values.replace(" | ", " or "))
    };
    for rule in rules {
        let of = rule.get("of").and_then(toml::Value::as_str).unwrap_or_default();
        let needs = rule.get("needs").and_then(toml::Value::as_array).into_iter().flatten();
        let needs: Vec<(&str, &str)> = needs
            .filter_map(toml::Value::as_str)
            .map(|need| need.split_once(": ").unwrap_or((need, "")))
            .collect();
        let named: Vec<String> = needs.iter().map(|need| condition(need.0)).collect();
        let mut reasons: Vec<&str> =
            needs.iter().map(|need| need.1).filter(|text| !text.is_empty()).collect();
        reasons.dedup();
        rows.push(vec![condition(of), named.join(", "), reasons.join("; ")]);
    }
    Ok(markdown(&rows))
}

/// An item of an enumeration.
pub struct Item<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its number, as text.
    pub number: &'a str,
    /// What it means.
    pub text: &'a str,
}

/// The items of an enumeration.
pub fn items<'a>(description: &'a str, name: &str) -> Vec<Item<'a>> {
    let opening = format!("<SimpleType name=\"{name}\"");
    let Some((_, rest)) = description.split_once(&opening) else { return Vec::new() };
    let body = rest.split("</SimpleType>").next().unwrap_or_default();
    let item = |text| {
        let text_of = attribute(text, "description").unwrap_or_default();
        Some(Item { name: attribute(text, "name")?, number: attribute(text, "value")?, text: text_of })
    };
    body.split("<Item ").skip(1).filter_map(item).collect()
}

/// The first attribute of a name in a text; the description is our own, so no general XML is met.
pub fn attribute<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let key = format!("{name}=\"");
    let begins_a_word = |at: &usize| text[..*at].ends_with([' ', '\n']) || *at == 0;
    let at = text.match_indices(&key).map(|(at, _)| at).find(begins_a_word)?;
    text[at + key.len()..].split('"').next()
}

/// XML text as Markdown.
fn plain(text: &str) -> String {
    [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")]
        .iter()
        .fold(text.to_string(), |text, (entity, letter)| text.replace(entity, letter))
}

/// A number as a reader likes it.
fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-2..1e5).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells with commas and quotes come back as they were.
    #[test]
    fn a_result_file_reads_back_as_it_was_written() {
        let head = HEAD.map(|name| (name.to_string(), format!("a {name}"))).to_vec();
        let row = ["a, b", "say \"c\"", "", "5 %"].map(str::to_string).to_vec();
        let measured = Measured { head, rows: vec![["w", "x", "y", "z"].map(str::to_string).to_vec(), row] };
        let copy = Measured::parse(&measured.text()).unwrap();
        assert_eq!((copy.head, copy.rows), (measured.head, measured.rows));
        assert!(Measured::parse("# title: x\na,b\n").is_err_and(|text| text.contains("command")));
        let ragged = format!("{}a,b\n1\n", HEAD.map(|name| format!("# {name}: x\n")).concat());
        assert!(Measured::parse(&ragged).is_err_and(|text| text.contains("cells")));
    }

    /// Columns without a value are dropped, and a bar inside a cell does not end it.
    #[test]
    fn a_table_shows_what_it_has() {
        let rows = [["case", "empty", "value"], ["1", "", "|v|"], ["1", "", "2"]];
        let rows: Vec<Vec<String>> = rows.map(|row| row.map(str::to_string).to_vec()).to_vec();
        assert_eq!(markdown(&rows), "| case | value |\n|---|---|\n| 1 | \\|v\\| |\n|  | 2 |\n");
    }

    /// A choice is shown with its numbers, an angle in degrees.
    #[test]
    fn variables_show_what_an_importer_sets() {
        let description = r#"<SimpleType name="Heat"><Item name="none" value="1" description="a &lt; b"/>
            <Item name="adiabatic" value="2" description="x"/><Item name="new" value="3"
            description="y (not in this version)"/></SimpleType>"#;
        let choice = r#"name="effects.heat"><Enumeration declaredType="Heat" start="2"/>"#;
        assert_eq!(
            start_and_range(choice, description),
            ["adiabatic (2)", "none (1), adiabatic (2), new (3, not in this version)"]
        );
        let angle = r#"name="a"><Real unit="rad" min="-1.0471975511965976" start="0"/>"#;
        assert_eq!(start_and_range(angle, description), ["0", "-60° to …"]);
        assert_eq!(plain(items(description, "Heat")[0].text), "a < b");
    }

    /// Every committed result file has its head and a table.
    #[test]
    fn every_result_file_can_be_read() {
        let names = names().unwrap();
        assert!(names.len() > 20, "{names:?}");
        for name in names {
            let measured = Measured::read(&name).unwrap();
            assert!(measured.rows.len() > 1, "{name} has no rows");
            assert!(HEAD.iter().all(|entry| !measured.entry(entry).is_empty()), "{name}");
        }
    }
}
