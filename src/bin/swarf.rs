//! Command line of the project: prints what is generated from the variable table; runs the studies where they are built in.

use std::process::ExitCode;

const HELP: &str = "\
usage: swarf COMMAND

  describe    print modelDescription.xml
  variables   print the table of all variables in Markdown
  version     print the version
  verify --out DIR
              run the problems with exact solutions, write table and plots (with feature `study`)";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["describe"] => print!("{}", swarf::fmi::description::xml()),
        ["variables"] => print!("{}", swarf::variables::markdown_table()),
        ["version" | "--version"] => println!("swarf {}", swarf::VERSION),
        #[cfg(feature = "study")]
        ["verify", "--out", folder] => return verify(folder.as_ref()),
        ["help" | "--help" | "-h"] => println!("{HELP}"),
        [] => {
            eprintln!("{HELP}");
            return ExitCode::from(2);
        }
        [command, ..] => {
            eprintln!("swarf: '{command}' with these arguments is not a command\n\n{HELP}");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

/// Runs all problems with exact solutions, writes what they give into a folder and prints the table.
#[cfg(feature = "study")]
fn verify(folder: &std::path::Path) -> ExitCode {
    let report = swarf::study::verification::verify(|name, seconds| println!("{name}: {seconds:.1} s"));
    println!("\n{}", report.markdown());
    let unmet = report.findings.iter().filter(|finding| finding.is_met() == Some(false)).count();
    println!(
        "{unmet} of {} figures miss their criterion; files are in {}",
        report.findings.len(),
        folder.display()
    );
    match report.write(folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("swarf: {error}");
            ExitCode::FAILURE
        }
    }
}
