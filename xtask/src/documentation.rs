//! The FMU's own documentation: `modelDescription/documentation/index.html` with pages of the book in place
//! of their marks, put together when the FMU is packaged, with tables made anew, so that the page inside an
//! FMU always speaks of that FMU.

use pulldown_cmark::{CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd, html};

use crate::papers::anchor;
use crate::tables::Place;
use crate::{Outcome, book, process};

/// Begin and end of a mark that a page of the book takes the place of: `<!-- page use/limits.md -->`.
const MARK: [&str; 2] = ["<!-- page ", " -->"];

/// The page with the book's pages in place of their marks.
///
/// # Errors
/// A template without marks, or a page that cannot be read.
pub fn complete(template: &str) -> Outcome<String> {
    let names: Vec<&str> =
        template.split(MARK[0]).skip(1).filter_map(|rest| Some(rest.split_once(MARK[1])?.0)).collect();
    if names.is_empty() {
        return Err(format!(
            "documentation/index.html has no place for pages: it needs {}NAME{}",
            MARK[0], MARK[1]
        ));
    }
    let mut page = template.to_string();
    for name in &names {
        let text = process::read(&book::folder().join(name))?;
        // Links to sources are links out of the included pages, which stay as words.
        let text = book::with_tables(&text, Place::Book("../evidence/sources.md"))?;
        page =
            page.replace(&format!("{}{name}{}", MARK[0], MARK[1]), converted(&text, name, &names).trim_end());
    }
    Ok(page)
}

/// A page of the book as HTML below a heading of second order. Links to included pages stay links, others
/// become words; pictures are left out.
fn converted(text: &str, name: &str, included: &[&str]) -> String {
    let events: Vec<Event> = Parser::new_ext(text, Options::ENABLE_TABLES).collect();
    let (mut kept, mut links, mut is_picture) = (Vec::new(), Vec::new(), false);
    for (k, event) in events.iter().enumerate() {
        match event {
            Event::Html(_) | Event::InlineHtml(_) => {}
            Event::Start(Tag::HtmlBlock) | Event::End(TagEnd::HtmlBlock) => {}
            Event::Start(Tag::Image { .. }) => is_picture = true,
            Event::End(TagEnd::Image) => is_picture = false,
            _ if is_picture => {}
            Event::Start(Tag::Heading { level, classes, attrs, .. }) => {
                let heading = if *level == HeadingLevel::H1 { String::new() } else { words(&events[k..]) };
                let (level, id) = (below(*level), Some(CowStr::from(id(name, &heading))));
                kept.push(Event::Start(Tag::Heading {
                    level,
                    id,
                    classes: classes.clone(),
                    attrs: attrs.clone(),
                }));
            }
            Event::End(TagEnd::Heading(level)) => kept.push(Event::End(TagEnd::Heading(below(*level)))),
            Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
                let target = target(dest_url, name, included);
                links.push(target.is_some());
                kept.extend(target.map(|target| {
                    let (dest_url, title, id) = (CowStr::from(target), title.clone(), id.clone());
                    Event::Start(Tag::Link { link_type: *link_type, dest_url, title, id })
                }));
            }
            Event::End(TagEnd::Link) => kept.extend(links.pop().unwrap_or(false).then(|| event.clone())),
            other => kept.push(other.clone()),
        }
    }
    let mut page = String::new();
    html::push_html(&mut page, kept.into_iter());
    page.replace("<table>", "<div class=\"scroll\"><table>").replace("</table>", "</table></div>")
}

/// The words of the heading that begins here.
fn words(events: &[Event]) -> String {
    let inside = events.iter().take_while(|event| !matches!(event, Event::End(TagEnd::Heading(_))));
    let word = |event: &Event| match event {
        Event::Text(words) | Event::Code(words) => words.to_string(),
        _ => String::new(),
    };
    inside.map(word).collect()
}

/// The name by which a heading of a page can be linked to.
fn id(page: &str, heading: &str) -> String {
    let stem = page.rsplit('/').next().unwrap_or(page).trim_end_matches(".md");
    if heading.is_empty() { stem.to_string() } else { format!("{stem}-{}", anchor(heading)) }
}

/// Where a link leads within the page, if what it names is included.
fn target(link: &str, page: &str, included: &[&str]) -> Option<String> {
    let (file, heading) = link.split_once('#').unwrap_or((link, ""));
    let stem = |path: &str| path.rsplit('/').next().unwrap_or(path).to_string();
    let file = if file.is_empty() { page } else { file };
    let known = included.iter().find(|name| stem(name) == stem(file))?;
    Some(format!("#{}", id(known, heading)))
}

fn below(level: HeadingLevel) -> HeadingLevel {
    HeadingLevel::try_from(level as usize + 1).unwrap_or(HeadingLevel::H6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{attribute, variables_of};

    /// Headings go one level down and get names; links stay where they lead to the page; pictures and marks
    /// go.
    #[test]
    fn a_page_of_the_book_becomes_a_part_of_the_page() {
        let text = "# Limits\n\n![p](p.png) [a](parameters.md#enumerations) [b](../x.md) [c](#more)\n\n## More\n\n\
            <!-- table x -->\n\n| `a` |\n|---|\n| b |\n\n<!-- end -->\n";
        let page = converted(text, "use/limits.md", &["use/limits.md", "use/parameters.md"]);
        assert!(page.contains("<h2 id=\"limits\">Limits</h2>"), "{page}");
        assert!(page.contains("<h3 id=\"limits-more\">More</h3>"), "{page}");
        assert!(
            page.contains("<a href=\"#parameters-enumerations\">a</a> b <a href=\"#limits-more\">c</a>"),
            "{page}"
        );
        assert!(
            page.contains("<th><code>a</code></th>") && !page.contains("<!--") && !page.contains("png"),
            "{page}"
        );
    }

    /// The committed template has its places, every variable gets its line, and links lead somewhere.
    #[test]
    fn the_committed_page_shows_every_variable() {
        let folder = crate::root().join("modelDescription");
        let page = complete(&process::read(&folder.join("documentation/index.html")).unwrap()).unwrap();
        let description = process::read(&folder.join("modelDescription.xml")).unwrap();
        for variable in variables_of(&description) {
            let name = attribute(variable, "name").unwrap();
            assert!(page.contains(&format!("<td><code>{name}</code></td>")), "{name}");
        }
        assert!(page.contains("adiabatic (2)"), "choices are shown with their numbers");
        for target in page.split("href=\"#").skip(1).filter_map(|rest| rest.split_once('"')) {
            assert!(page.contains(&format!("id=\"{}\"", target.0)), "#{}", target.0);
        }
        assert!(complete("<p>no mark</p>").is_err());
    }
}
