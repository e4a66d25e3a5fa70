//! Command line of the project: prints what is generated from the variable table.

use std::process::ExitCode;

const HELP: &str = "\
usage: swarf COMMAND

  describe    print modelDescription.xml
  variables   print the table of all variables in Markdown
  version     print the version";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["describe"] => print!("{}", swarf::fmi::description::xml()),
        ["variables"] => print!("{}", swarf::variables::markdown_table()),
        ["version" | "--version"] => println!("swarf {}", swarf::VERSION),
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
