//! What README and book may say, and where their links lead: rules that a change of text can break.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use crate::book::{folder, pages, shown, without_tables};
use crate::{Outcome, process, root};

/// Most lines of the README: two screens of essentials.
const README_LINES: usize = 150;
/// Units of what commands measure; a number before one of them belongs into a generated table.
const MEASURED_UNITS: [&str; 5] = ["N/mm", "GPa", "CPU s", "CPU seconds", "million"];
/// Words of a diary of machines.
const DIARY: [&str; 9] = [
    "EPYC",
    "Zen 3",
    "Zen 4",
    "Zen 5",
    "fresh clone",
    "other work",
    "nothing beside",
    "busier",
    "not in the repository",
];
const MONTHS: [&str; 12] = [
    "January",
    "February",
    "March",
    "April",
    "May",
    "June",
    "July",
    "August",
    "September",
    "October",
    "November",
    "December",
];

/// Checks all pages.
///
/// # Errors
/// Every finding on a line of its own, with page and line.
pub fn check() -> Outcome {
    let mut texts = BTreeMap::new();
    let mut all = pages()?;
    all.extend(["CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name)));
    for page in all {
        texts.insert(page.clone(), process::read(&page)?);
    }
    let mut findings = Vec::new();
    for (page, text) in &texts {
        let name = shown(page);
        let is_readme = name == "README.md";
        let in_book = page.starts_with(folder());
        if is_readme && text.lines().count() > README_LINES {
            findings.push(format!("{name}: {} lines; at most {README_LINES}", text.lines().count()));
        }
        let own = without_tables(text);
        for (number, line) in (1..).zip(prose(&own)) {
            let mut found = Vec::new();
            if is_readme || in_book {
                found.extend(diary(line));
            }
            if is_readme {
                found.extend(row_with_number(line));
            }
            if is_readme || name.starts_with("book/src/evidence") {
                found.extend(figure(line));
            }
            findings.extend(found.into_iter().map(|text| format!("{name}:{number}: {text}")));
        }
        findings.extend(broken_links(page, text, &texts).into_iter().map(|text| format!("{name}: {text}")));
    }
    findings.extend(unlisted(&texts)?);
    if findings.is_empty() { Ok(()) } else { Err(findings.join("\n")) }
}

/// The lines of a text, empty where they are code.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    text.lines().map(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        if is_code || is_fence { "" } else { line }
    })
}

/// A commit, a date or a word of a machine's story.
fn diary(line: &str) -> Vec<String> {
    let is_letter = |letter: char| letter.is_ascii_alphanumeric() || letter == '-';
    let mut found = Vec::new();
    let words: Vec<&str> = line.split(|letter| !is_letter(letter)).filter(|word| !word.is_empty()).collect();
    for (k, &word) in words.iter().enumerate() {
        let is_hexadecimal = word.chars().all(|letter| matches!(letter, '0'..='9' | 'a'..='f'));
        let mixes = word.chars().any(|l| l.is_ascii_digit()) && word.chars().any(|l| l.is_ascii_alphabetic());
        if is_hexadecimal && mixes && (7..=40).contains(&word.len()) {
            found.push(format!("'{word}' looks like a commit"));
        }
        let is_day = |text: &str| {
            let parts: Vec<&str> = text.split('-').collect();
            parts.len() == 3 && parts[0].len() == 4 && parts.iter().all(|part| part.parse::<u32>().is_ok())
        };
        let is_year = |word: Option<&&str>| word.is_some_and(|w| w.len() == 4 && w.starts_with("20"));
        if is_day(word) || (MONTHS.contains(&word) && is_year(words.get(k + 1))) {
            found.push(format!("'{word}' is a date"));
        }
    }
    found.extend(
        DIARY.iter().filter(|word| line.contains(**word)).map(|word| format!("'{word}' tells of a machine")),
    );
    found
}

/// A row of a table that holds a number and was not generated.
fn row_with_number(line: &str) -> Option<String> {
    let is_row = line.trim_start().starts_with('|');
    (is_row && line.contains(|letter: char| letter.is_ascii_digit()))
        .then(|| "a table with numbers that comes from no result file".into())
}

/// A number with the unit of a measurement outside generated tables.
fn figure(line: &str) -> Option<String> {
    let before = |at: usize| line[..at].trim_end().ends_with(|letter: char| letter.is_ascii_digit());
    let unit = MEASURED_UNITS.iter().find(|unit| line.match_indices(**unit).any(|(at, _)| before(at)))?;
    Some(format!("a figure in {unit} that no command writes: '{}'", line.trim()))
}

/// Relative links of a page that lead nowhere.
fn broken_links(page: &Path, text: &str, texts: &BTreeMap<PathBuf, String>) -> Vec<String> {
    let parent = page.parent().unwrap_or(page);
    let mut broken = Vec::new();
    for link in links(text) {
        if link.contains("://") || link.starts_with("mailto:") {
            continue;
        }
        let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
        let path = if file.is_empty() { page.to_path_buf() } else { normal(&parent.join(file)) };
        if !path.exists() {
            broken.push(format!("the link '{link}' leads nowhere"));
        } else if page.starts_with(folder()) && !path.starts_with(folder()) {
            broken.push(format!("the link '{link}' leads out of the book"));
        } else if !anchor.is_empty() {
            let known = match texts.get(&path) {
                Some(text) => anchors(text),
                None => process::read(&path).map(|text| anchors(&text)).unwrap_or_default(),
            };
            if !known.contains(anchor) {
                broken.push(format!("the link '{link}' names no heading of {}", shown(&path)));
            }
        }
    }
    broken
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            std::path::Component::ParentDir => {
                parts.pop();
            }
            std::path::Component::CurDir => {}
            other => parts.push(other),
        }
    }
    parts
}

fn parser(text: &str) -> Parser<'_> {
    Parser::new_ext(text, Options::ENABLE_TABLES)
}

/// Targets of all links and pictures.
fn links(text: &str) -> Vec<String> {
    let target = |event| match event {
        Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => Some(dest_url.to_string()),
        _ => None,
    };
    parser(text).filter_map(target).collect()
}

/// The names by which a page's headings can be linked to, as mdBook and GitHub make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let (mut anchors, mut heading) = (BTreeSet::new(), None::<String>);
    for event in parser(text) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                anchors.extend(heading.take().map(|words| anchor(&words)));
            }
            Event::Text(words) | Event::Code(words) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&words);
                }
            }
            Event::Html(html) | Event::InlineHtml(html) => {
                let ids = html.split("id=\"").skip(1).filter_map(|rest| rest.split_once('"'));
                anchors.extend(ids.map(|(id, _)| id.to_string()));
            }
            _ => {}
        }
    }
    anchors
}

/// A heading's words as the name of a place.
pub fn anchor(heading: &str) -> String {
    let letter = |letter: char| match letter {
        letter if letter.is_alphanumeric() || letter == '-' || letter == '_' => letter.to_lowercase().next(),
        letter if letter.is_whitespace() => Some('-'),
        _ => None,
    };
    heading.chars().filter_map(letter).collect()
}

/// Pages that the summary does not name, and pictures that no page shows.
fn unlisted(texts: &BTreeMap<PathBuf, String>) -> Outcome<Vec<String>> {
    let mut findings = Vec::new();
    let all: BTreeSet<PathBuf> = texts
        .iter()
        .flat_map(|(page, text)| {
            let parent = page.parent().unwrap_or(page).to_path_buf();
            links(text)
                .into_iter()
                .map(move |link| normal(&parent.join(link.split('#').next().unwrap_or(""))))
        })
        .collect();
    let summary = folder().join("SUMMARY.md");
    let listed: BTreeSet<PathBuf> = links(texts.get(&summary).ok_or("the book has no SUMMARY.md")?)
        .iter()
        .map(|link| folder().join(link))
        .collect();
    for page in texts.keys().filter(|page| page.starts_with(folder()) && **page != summary) {
        if !listed.contains(page) {
            findings.push(format!("{} is not in SUMMARY.md", shown(page)));
        }
    }
    let pictures = folder().join("pictures");
    let entries = std::fs::read_dir(&pictures).map_err(|e| format!("'{}': {e}", pictures.display()))?;
    for picture in entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| !all.contains(path)) {
        findings.push(format!("{} is shown on no page", shown(&picture)));
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each rule finds what it is for, and leaves ordinary prose alone.
    #[test]
    fn the_rules_find_what_they_are_for() {
        for line in ["of a3ea0fd", "(29 November 2026)", "on 2026-11-29", "Zen 5", "in a fresh clone"] {
            assert_eq!(diary(line).len(), 1, "{line}");
        }
        for line in
            ["Ambati et al. (2011)", "1000000 points", "deadbeef is a word", "in May it may", "2.07e11 Pa"]
        {
            assert!(diary(line).is_empty(), "{line}: {:?}", diary(line));
        }
        assert!(row_with_number("| force | 617 |").is_some());
        assert!(row_with_number("| force | value |").is_none() && row_with_number("617 points").is_none());
        assert!(figure("takes 18.8 CPU s").is_some() && figure("617 N/mm").is_some());
        assert!(figure("in N/mm of width").is_none() && figure("43 million point-steps").is_some());
    }

    /// A link to a file or a heading that is not there is found.
    #[test]
    fn broken_links_are_found() {
        let page = root().join("README.md");
        let text =
            "# A `b` c, d\n[a](#a-b-c-d) [b](#nowhere) [c](no/such.md) [d](Cargo.toml) [e](https://x.y/z)";
        let broken = broken_links(&page, text, &BTreeMap::from([(page.clone(), text.to_string())]));
        assert_eq!(broken.len(), 2, "{broken:?}");
        assert!(anchors("<h3 id=\"levels\">levels</h3>").contains("levels"));
    }

    /// Code is no prose.
    #[test]
    fn code_is_left_alone() {
        let lines: Vec<&str> = prose("a\n```sh\n| 1 |\n```\nb").collect();
        assert_eq!(lines, ["a", "", "", "", "b"]);
    }

    /// README, book, CONTRIBUTING and CHANGELOG as they are committed.
    #[test]
    fn the_papers_keep_the_rules() {
        if let Err(findings) = check() {
            panic!("\n{findings}");
        }
    }
}
