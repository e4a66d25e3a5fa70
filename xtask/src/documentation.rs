//! The tables of the FMU's own documentation, made from its model description and the price list when it is packaged, so
//! that the page inside an FMU always speaks of that FMU.

use crate::Outcome;

/// Stands in `modelDescription/documentation/index.html` where the tables go.
const MARK: &str = "<!-- variables -->";

/// The page with one table per causality in place of its mark.
///
/// # Errors
/// A page without the mark, or a description without variables.
pub fn with_variables(page: &str, description: &str) -> Outcome<String> {
    if !page.contains(MARK) {
        return Err(format!("documentation/index.html has no place for the variables: it needs {MARK}"));
    }
    let mut tables = String::new();
    for (causality, title) in [("input", "Inputs"), ("output", "Outputs"), ("parameter", "Parameters")] {
        let rows: Vec<String> = description
            .split("<ScalarVariable ")
            .skip(1)
            .filter(|variable| attribute(variable, "causality") == Some(causality))
            .map(|variable| row(variable, description))
            .collect();
        if rows.is_empty() {
            return Err(format!("modelDescription.xml has no variable of causality {causality}"));
        }
        let head = "<tr><th>name</th><th>unit</th><th>start</th><th>range</th><th>meaning</th></tr>";
        tables.push_str(&format!("<h3>{title}</h3>\n<table>\n{head}\n{}\n</table>\n", rows.join("\n")));
    }
    Ok(page.replace(MARK, tables.trim_end()))
}

/// Stands in the page where the price list goes.
const PRICE_MARK: &str = "<!-- price list -->";

/// The page with the presets of `resources/price_list.csv` in place of their mark.
///
/// # Errors
/// A page without the mark, or a list that cannot be read.
pub fn with_price_list(page: &str, list: &str) -> Outcome<String> {
    if !page.contains(PRICE_MARK) {
        return Err(format!(
            "documentation/index.html has no place for the price list: it needs {PRICE_MARK}"
        ));
    }
    let mut lines = list.lines().filter(|line| !line.starts_with('#'));
    let columns: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let outputs =
        columns.get(4..).filter(|outputs| !outputs.is_empty()).ok_or("price_list.csv has no head")?;
    let heads: String = outputs.iter().map(|name| format!("<th><code>{name}</code></th>")).collect();
    let mut rows = String::new();
    for line in lines.filter(|line| line.starts_with("preset")) {
        let fields: Vec<&str> = line.split(',').collect();
        let [kind, name, numbers @ ..] = fields.as_slice() else { continue };
        let heat = kind.strip_prefix("preset").unwrap_or_default();
        let numbers: Option<Vec<f64>> = numbers.iter().map(|text| text.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == outputs.len() + 2);
        let numbers = numbers.ok_or_else(|| format!("price_list.csv cannot be read at '{line}'"))?;
        let bands: String =
            numbers[2..].iter().map(|band| format!("<td>&plusmn;{:.1} %</td>", 100.0 * band)).collect();
        let (spacing, seconds) = (1e6 * numbers[0], numbers[1]);
        rows.push_str(&format!(
            "<tr><td><code>{name}</code>{heat}</td><td>{spacing:.0} &micro;m</td><td>{seconds:.1} s</td>{bands}</tr>\n"
        ));
    }
    let head = format!("<tr><th>preset</th><th>spacing</th><th>CPU time</th>{heads}</tr>");
    Ok(page.replace(PRICE_MARK, &format!("<table>\n{head}\n{rows}</table>")))
}

/// One variable as a line of a table. Texts come from XML, so they are escaped for HTML already.
fn row(variable: &str, description: &str) -> String {
    let of = |name| attribute(variable, name).unwrap_or_default();
    let start = of("start");
    let items = attribute(variable, "declaredType").map(|name| items(description, name)).unwrap_or_default();
    let (start, range) = if items.is_empty() {
        let range = match (of("min"), of("max")) {
            ("", "") => String::new(),
            (min, "") => format!("from {min}"),
            ("", max) => format!("up to {max}"),
            (min, max) => format!("{min} to {max}"),
        };
        (start.to_string(), range)
    } else {
        let chosen = items.iter().find(|(_, number)| *number == start).map_or("", |(name, _)| name);
        let names: Vec<String> = items.iter().map(|(name, number)| format!("{name} ({number})")).collect();
        (chosen.to_string(), names.join(", "))
    };
    let (name, unit, text) = (of("name"), of("unit"), of("description"));
    format!(
        "<tr><td><code>{name}</code></td><td>{unit}</td><td>{start}</td><td>{range}</td><td>{text}</td></tr>"
    )
}

/// Names and numbers of an enumeration's items.
fn items<'a>(description: &'a str, name: &str) -> Vec<(&'a str, &'a str)> {
    let opening = format!("<SimpleType name=\"{name}\"");
    let Some((_, rest)) = description.split_once(&opening) else { return Vec::new() };
    let body = rest.split("</SimpleType>").next().unwrap_or_default();
    let items = body.split("<Item ").skip(1);
    items.filter_map(|item| Some((attribute(item, "name")?, attribute(item, "value")?))).collect()
}

/// The first attribute of a name in a text; the description is our own, so no general XML is met.
fn attribute<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let key = format!("{name}=\"");
    let begins_a_word = |at: &usize| text[..*at].ends_with([' ', '\n']) || *at == 0;
    let at = text.match_indices(&key).map(|(at, _)| at).find(begins_a_word)?;
    text[at + key.len()..].split('"').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quantity with a range and a choice, as the description writes them.
    #[test]
    fn variables_become_lines_of_tables() {
        let description = r#"<SimpleType name="Scene"><Item name="cut" value="1"/><Item name="press" value="2"/></SimpleType>
            <ScalarVariable name="feed" description="depth &lt; height" causality="input">
              <Real unit="m" displayUnit="mm" min="0" start="3e-4"/></ScalarVariable>
            <ScalarVariable name="cutting_force" description="force" causality="output"><Real unit="N"/></ScalarVariable>
            <ScalarVariable name="scene" description="process" causality="parameter">
              <Enumeration declaredType="Scene" min="1" max="2" start="1"/></ScalarVariable>"#;
        let page = with_variables("<p>before</p><!-- variables -->", description).unwrap();
        let feed = "<tr><td><code>feed</code></td><td>m</td><td>3e-4</td><td>from 0</td><td>depth &lt; height</td></tr>";
        assert!(page.contains(feed), "{page}");
        assert!(page.contains("<td>cut</td><td>cut (1), press (2)</td>"), "{page}");
        assert!(with_variables("<p>no mark</p>", description).is_err());
    }

    /// A preset becomes a line with its bands in percent; lines of other kinds do not.
    #[test]
    fn presets_become_lines_of_the_price_list() {
        let list = "# remark\nkind,name,point_spacing,cpu_seconds,cutting_force,thrust_force\n\
            spacing,,1e-5,20.0,0.5,0.5\npreset,fine,1e-5,6.23,0.0512,0.2\n\
            preset with conduction,fine,1e-5,7.0,0.04,0.1\n";
        let page = with_price_list("<p>before</p><!-- price list -->", list).unwrap();
        let line = "<tr><td><code>fine</code></td><td>10 &micro;m</td><td>6.2 s</td><td>&plusmn;5.1 %</td><td>&plusmn;20.0 %</td></tr>";
        assert!(page.contains(line) && page.matches("<tr>").count() == 3, "{page}");
        assert!(page.contains("<code>fine</code> with conduction</td>"), "{page}");
        assert!(with_price_list("<p>no mark</p>", list).is_err());
        assert!(with_price_list(PRICE_MARK, &list.replace("6.23", "cheap")).is_err());
    }

    /// The committed page has its place, and every variable gets its line.
    #[test]
    fn the_committed_page_shows_every_variable() {
        let read =
            |name: &str| std::fs::read_to_string(crate::root().join("modelDescription").join(name)).unwrap();
        let (page, description) = (read("documentation/index.html"), read("modelDescription.xml"));
        let page = with_variables(&page, &description).unwrap();
        assert_eq!(page.matches("<tr><td>").count(), description.matches("<ScalarVariable ").count());
        assert!(page.contains("<td>adiabatic</td>"), "an enumeration's start is shown by its name");
    }
}
