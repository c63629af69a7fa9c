//! Figures of a GPU's compiler about a pipeline: those that cost time, their budget, and the committed table of them.

use edgeshade::gpu::Statistic;
use edgeshade::{Error, Result};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

/// Figures of one program, under the same names for all drivers. A figure that the driver does not tell is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Figures {
    /// Registers of a thread.
    pub registers: Option<u64>,
    /// Registers that did not fit and were moved elsewhere.
    pub spilled_registers: Option<u64>,
    /// Scratch memory of a subgroup.
    pub scratch_bytes: Option<u64>,
    /// Shared memory of a workgroup.
    pub shared_bytes: Option<u64>,
    /// Machine code.
    pub code_bytes: Option<u64>,
    /// Subgroups that a SIMD unit keeps in flight.
    pub subgroups_per_simd: Option<u64>,
    /// Machine instructions.
    pub instructions: Option<u64>,
}

impl Figures {
    /// Finds the figures among the statistics of Mesa's drivers for AMD and Intel and of NVIDIA's driver.
    pub fn new(statistics: &[Statistic]) -> Self {
        let sum = |names: &[&str]| {
            let is_named = |s: &&Statistic| names.iter().any(|name| name.eq_ignore_ascii_case(&s.name));
            let values = statistics.iter().filter(is_named).map(|s| s.value.as_f64().max(0.0) as u64);
            values.reduce(u64::saturating_add)
        };
        Self {
            registers: sum(&["VGPRs", "Register Count"]),
            spilled_registers: sum(&["Spilled VGPRs", "Spilled SGPRs", "Spill Count"]),
            scratch_bytes: sum(&["Scratch size", "Scratch Memory Size"]),
            shared_bytes: sum(&["LDS size", "Workgroup Memory Size"]),
            code_bytes: sum(&["Code size", "Binary Size"]),
            subgroups_per_simd: sum(&["Subgroups per SIMD"]),
            instructions: sum(&["Instructions", "Instruction Count"]),
        }
    }

    /// The limits that the figures break, each in words; empty within the budget.
    pub fn over_budget(&self) -> Vec<String> {
        let figures = COLUMNS.iter().filter_map(|c| Some((c, (c.figure)(self)?, c.limit?)));
        let broken = figures.filter(|&(c, figure, limit)| c.is_worse(figure, limit));
        broken.map(|(c, figure, limit)| format!("{} {figure} ({} {limit})", c.name, c.bound())).collect()
    }
}

/// Figure that the table holds.
struct Column {
    name: &'static str,
    figure: fn(&Figures) -> Option<u64>,
    more_is_better: bool,
    /// Worst figure within the budget.
    limit: Option<u64>,
}

impl Column {
    fn is_worse(&self, figure: u64, than: u64) -> bool {
        if self.more_is_better { figure < than } else { figure > than }
    }

    fn bound(&self) -> &'static str {
        if self.more_is_better { "at least" } else { "at most" }
    }
}

const COLUMNS: [Column; 5] = [
    Column { name: "registers", figure: |f| f.registers, more_is_better: false, limit: None },
    Column { name: "spilled registers", figure: |f| f.spilled_registers, more_is_better: false, limit: Some(0) },
    Column { name: "scratch bytes", figure: |f| f.scratch_bytes, more_is_better: false, limit: Some(0) },
    // The instruction cache of many GPUs.
    Column { name: "code bytes", figure: |f| f.code_bytes, more_is_better: false, limit: Some(32 << 10) },
    // A quarter of what RADV reports for a small shader on RDNA 2; its counts for other GPUs have other maxima.
    Column { name: "subgroups per SIMD", figure: |f| f.subgroups_per_simd, more_is_better: true, limit: Some(8) },
];

/// Figures of one program of a pipeline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Name of the pipeline, without constants.
    pub pipeline: String,
    /// The rest of the program's name, which no other program of the pipeline has: constants and stage.
    pub form: String,
    pub figures: Figures,
}

impl Row {
    /// Name of the program, which no other program has.
    pub fn name(&self) -> String {
        format!("{} {}", self.pipeline, self.form).trim_end().to_owned()
    }
}

/// Program whose excess over the budget is known, and why it is left.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Known {
    /// [`Row::name`].
    name: String,
    reason: String,
}

/// The committed page: figures of one driver for one device, and those known to be over the budget.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page {
    pub device: String,
    pub driver: String,
    known: Vec<Known>,
    rows: Vec<Row>,
}

/// Result of a comparison, in lines.
#[derive(Debug, Default, PartialEq, Eq, Serialize)]
pub struct Check {
    /// False if the page is another driver's, whose figures say nothing about this one's.
    pub compared: bool,
    /// Reasons to fail.
    pub faults: Vec<String>,
    /// Programs over the budget that the page knows.
    pub known: Vec<String>,
    /// Figures that are better than the page's.
    pub improvements: Vec<String>,
}

impl Check {
    /// The result for people. `before` is the page's driver and `now` the one at hand.
    pub fn text(&self, before: &str, now: &str) -> String {
        let Self { faults, known, improvements, .. } = self;
        let mut text = String::new();
        if !self.compared {
            text += &format!("NOT COMPARED: the table is of {before}, and this is {now}; the budget alone counts\n");
        }
        let titled =
            [("known to be over the budget", known), ("better (--write keeps it)", improvements), ("FAULT", faults)];
        for (title, lines) in titled {
            text.extend(lines.iter().map(|line| format!("{title}: {line}\n")));
        }
        text + &format!("faults: {}, known: {}, better: {}\n", faults.len(), known.len(), improvements.len())
    }
}

const DEVICE: &str = "Device: ";
const DRIVER: &str = "Driver: ";
const KNOWN: &str = "## Known to be over the budget";
const FIGURES: &str = "## Figures";

impl Page {
    /// Makes a page of figures without any known excess.
    pub fn new(device: &str, driver: &str, mut rows: Vec<Row>) -> Self {
        rows.sort_by_key(Row::name);
        Self { device: device.into(), driver: driver.into(), known: vec![], rows }
    }

    /// Keeps what an older page knows: that part is written by hand.
    pub fn keep_known(self, old: Option<Self>) -> Self {
        Self { known: old.map_or(vec![], |old| old.known), ..self }
    }

    /// Reads a page.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::Io { path: path.into(), source })?;
        Self::parse(&text).map_err(|(line, problem)| Error::File {
            path: path.into(),
            place: format!("line {line}"),
            problem,
        })
    }

    /// Parses a page. An error is the number of the line and what is wrong with it.
    fn parse(text: &str) -> std::result::Result<Self, (usize, String)> {
        let mut page = Self { device: String::new(), driver: String::new(), known: vec![], rows: vec![] };
        let mut section = "";
        for (number, line) in (1..).zip(text.lines()) {
            if line.starts_with('#') {
                section = line;
            }
            if let Some(device) = line.strip_prefix(DEVICE) {
                page.device = device.into();
            }
            if let Some(driver) = line.strip_prefix(DRIVER) {
                page.driver = driver.into();
            }
            // A table begins with its headers and a rule.
            let is_head = line.starts_with("| pipeline") || line.starts_with("|---");
            let Some(cells) = line.strip_prefix("| ").filter(|_| !is_head) else { continue };
            let cells: Vec<_> = cells.trim_end().trim_end_matches('|').split('|').map(str::trim).collect();
            let parsed = match section {
                KNOWN => known(&cells).map(|known| page.known.push(known)),
                FIGURES => row(&cells).map(|row| page.rows.push(row)),
                _ => Err("a table in a section without one".into()),
            };
            parsed.map_err(|problem| (number, problem))?;
        }
        match page.device.is_empty() || page.driver.is_empty() || page.rows.is_empty() {
            true => Err((1, format!("no table of pipelines: it must have {DEVICE:?}, {DRIVER:?} and {FIGURES:?}"))),
            false => Ok(page),
        }
    }

    /// The page as Markdown.
    pub fn text(&self) -> String {
        let limits = COLUMNS.iter().filter_map(|c| Some(format!("{} {} {}", c.name, c.bound(), c.limit?)));
        let budget = limits.collect::<Vec<_>>().join(", ");
        let mut text = format!(
            "# Pipelines of the techniques at their defaults\n\n\
             {DEVICE}{}\n\
             {DRIVER}{}\n\n\
             The budget: {budget}. `make pipelines` checks it and compares with this page; `make bless-pipelines` writes the \
             figures. The list of what is known is written by hand.\n\n\
             {KNOWN}\n\n| pipeline | reason |\n|---|---|\n",
            self.device, self.driver
        );
        for Known { name, reason } in &self.known {
            let _ = writeln!(text, "| {name} | {reason} |");
        }
        let names = COLUMNS.map(|c| c.name).join(" | ");
        let _ = write!(text, "\n{FIGURES}\n\n| pipeline | {names} |\n|---|{}\n", "--:|".repeat(COLUMNS.len()));
        for row in &self.rows {
            let cells = COLUMNS.map(|c| (c.figure)(&row.figures).map_or("-".into(), |n| n.to_string()));
            let separator = if row.form.is_empty() { "" } else { " " };
            let _ = writeln!(text, "| `{}`{separator}{} | {} |", row.pipeline, row.form, cells.join(" | "));
        }
        text
    }

    /// Compares `now` with this page, and checks the budget. `complete` says that `now` has the pipelines of all
    /// techniques, so that what it lacks is gone.
    pub fn check(&self, now: &Self, complete: bool) -> Check {
        let mut check = Check { compared: self.driver == now.driver, ..Check::default() };
        if check.compared {
            self.compare(now, complete, &mut check);
        }
        let mut over = BTreeSet::new();
        for row in &now.rows {
            let broken = row.figures.over_budget().join(", ");
            if broken.is_empty() {
                continue;
            }
            over.insert(row.name());
            match self.known.iter().find(|k| k.name == row.name()) {
                Some(known) => check.known.push(format!("{}: {broken}; {}", row.name(), known.reason)),
                None => check.faults.push(format!("{}: over the budget: {broken}", row.name())),
            }
        }
        // Another driver's compiler may well do better.
        let is_judged = check.compared && complete;
        for Known { name, .. } in self.known.iter().filter(|k| is_judged && !over.contains(&k.name)) {
            check.faults.push(format!("{name}: not over the budget now: take it off the list of the known ones"));
        }
        check
    }

    fn compare(&self, now: &Self, complete: bool, check: &mut Check) {
        let find = |rows: &[Row], row: &Row| rows.iter().find(|r| r.name() == row.name()).map(|r| r.figures);
        for row in &now.rows {
            let Some(before) = find(&self.rows, row) else {
                check.faults.push(format!("{}: not in the table", row.name()));
                continue;
            };
            for column in &COLUMNS {
                let (before, now) = ((column.figure)(&before), (column.figure)(&row.figures));
                let shown = |n: Option<u64>| n.map_or("-".into(), |n| n.to_string());
                let line = format!("{}: {} {}, before {}", row.name(), column.name, shown(now), shown(before));
                match (before, now) {
                    _ if before == now => {}
                    (Some(before), Some(now)) if !column.is_worse(now, before) => check.improvements.push(line),
                    _ => check.faults.push(line),
                }
            }
        }
        for row in self.rows.iter().filter(|row| complete && find(&now.rows, row).is_none()) {
            check.faults.push(format!("{}: in the table, but no technique makes it", row.name()));
        }
    }
}

fn known(cells: &[&str]) -> std::result::Result<Known, String> {
    match cells {
        [name, reason] if !name.is_empty() && !reason.is_empty() => {
            Ok(Known { name: name.replace('`', ""), reason: (*reason).into() })
        }
        _ => Err("a known one must have its pipeline and the reason: | pipeline | reason |".into()),
    }
}

fn row(cells: &[&str]) -> std::result::Result<Row, String> {
    let wrong = || format!("a row must have a pipeline and {} figures", COLUMNS.len());
    let [name, figures @ ..] = cells else { return Err(wrong()) };
    let (pipeline, form) = name.strip_prefix('`').and_then(|rest| rest.split_once('`')).ok_or_else(wrong)?;
    let figure = |cell: &&str| match *cell {
        "-" => Ok(None),
        digits => digits.parse().map(Some).map_err(|_| format!("{digits:?} is no figure")),
    };
    let figures = figures.iter().map(figure).collect::<std::result::Result<Vec<Option<u64>>, _>>()?;
    let [registers, spilled_registers, scratch_bytes, code_bytes, subgroups_per_simd] = figures[..] else {
        return Err(wrong());
    };
    let figures =
        Figures { registers, spilled_registers, scratch_bytes, code_bytes, subgroups_per_simd, ..Figures::default() };
    Ok(Row { pipeline: pipeline.into(), form: form.trim().into(), figures })
}

#[cfg(test)]
mod tests {
    use super::*;
    use edgeshade::gpu::StatisticValue;

    fn statistics(figures: &[(&str, u64)]) -> Vec<Statistic> {
        let statistic = |&(name, n): &(&str, u64)| Statistic { name: name.into(), value: StatisticValue::Unsigned(n) };
        figures.iter().map(statistic).collect()
    }

    fn figures([registers, spilled, scratch, code, subgroups]: [u64; 5]) -> Figures {
        Figures {
            registers: Some(registers),
            spilled_registers: Some(spilled),
            scratch_bytes: Some(scratch),
            code_bytes: Some(code),
            subgroups_per_simd: Some(subgroups),
            ..Figures::default()
        }
    }

    fn row_of(pipeline: &str, form: &str, all: [u64; 5]) -> Row {
        Row { pipeline: pipeline.into(), form: form.into(), figures: figures(all) }
    }

    const SMALL: [u64; 5] = [32, 0, 0, 2484, 32];
    const LARGE: [u64; 5] = [256, 119, 98304, 62252, 4];

    fn page() -> Page {
        let rows = vec![row_of("soft/large.comp", "STEP=2", LARGE), row_of("a/small.comp", "", SMALL)];
        let known = vec![Known { name: "soft/large.comp STEP=2".into(), reason: "it is being split".into() }];
        Page { known, ..Page::new("Null hardware (RADV NAVI21)", "radv Mesa 22.3.6", rows) }
    }

    #[test]
    fn figures_are_found_under_each_drivers_names() {
        let amd = statistics(&[
            ("SGPRs", 128),
            ("VGPRs", 96),
            ("Spilled SGPRs", 5),
            ("Spilled VGPRs", 7),
            ("Code size", 1700),
            ("LDS size", 512),
            ("Scratch size", 21504),
            ("Subgroups per SIMD", 10),
            ("Instructions", 3302),
        ]);
        let expected =
            Figures { shared_bytes: Some(512), instructions: Some(3302), ..figures([96, 12, 21504, 1700, 10]) };
        assert_eq!(Figures::new(&amd), expected);
        let intel = statistics(&[("Instruction Count", 40), ("Spill Count", 2), ("Scratch Memory Size", 1024)]);
        let expected = Figures {
            instructions: Some(40),
            spilled_registers: Some(2),
            scratch_bytes: Some(1024),
            ..Figures::default()
        };
        assert_eq!(Figures::new(&intel), expected);
        let nvidia = Figures::new(&statistics(&[("Register Count", 48), ("Binary Size", 9000)]));
        assert_eq!((nvidia.registers, nvidia.code_bytes, nvidia.spilled_registers), (Some(48), Some(9000), None));
        assert_eq!(Figures::new(&[]), Figures::default());
    }

    #[test]
    fn the_budget_is_broken_by_each_figure_alone() {
        assert_eq!(figures([256, 0, 0, 32768, 8]).over_budget(), [""; 0]);
        assert_eq!(Figures::default().over_budget(), [""; 0], "what the driver does not tell breaks nothing");
        for (all, words) in [
            ([32, 1, 0, 100, 32], "spilled registers 1 (at most 0)"),
            ([32, 0, 4, 100, 32], "scratch bytes 4 (at most 0)"),
            ([32, 0, 0, 32769, 32], "code bytes 32769 (at most 32768)"),
            ([32, 0, 0, 100, 7], "subgroups per SIMD 7 (at least 8)"),
        ] {
            assert_eq!(figures(all).over_budget(), [words]);
        }
        assert_eq!(figures(LARGE).over_budget().len(), 4);
    }

    #[test]
    fn a_page_is_read_as_it_was_written() {
        let page = page();
        assert_eq!(page.rows[0].name(), "a/small.comp");
        assert_eq!(Page::parse(&page.text()), Ok(page.clone()));
        let silent = Figures { code_bytes: None, ..figures(SMALL) };
        let rows = vec![Row { figures: silent, ..row_of("volume sides", "vertex", SMALL) }];
        let other = Page::new("A", "B", rows).keep_known(Some(page.clone()));
        assert!(other.text().contains("\n| `volume sides` vertex | 32 | 0 | 0 | - | 32 |\n"), "{}", other.text());
        assert_eq!(Page::parse(&other.text()).unwrap(), other);
        assert_eq!(other.known, page.known);
        for (from, to, line, words) in [
            ("| 62252 |", "| many |", 19, "\"many\" is no figure"),
            ("| 119 ", "", 19, "5 figures"),
            ("| it is being split |", "|", 12, "the reason"),
            ("## Figures", "## Numbers", 18, "section"),
            (DEVICE, "", 1, "Device: "),
        ] {
            let text = page.text();
            assert!(text.contains(from), "{from}");
            let (at, problem) = Page::parse(&text.replace(from, to)).unwrap_err();
            assert!(at == line && problem.contains(words), "{from}: line {at}: {problem}");
        }
        assert!(Page::parse("").is_err());
    }

    #[test]
    fn what_is_as_before_passes_and_names_the_known() {
        let check = page().check(&page(), true);
        assert_eq!(check, Check { compared: true, known: check.known.clone(), ..Check::default() });
        let [known] = &check.known[..] else { panic!("{check:?}") };
        assert!(known.starts_with("soft/large.comp STEP=2: spilled registers 119") && known.ends_with("being split"));
    }

    /// Checks a page whose rows `change` has changed.
    fn checked(change: impl FnOnce(&mut Page)) -> Check {
        let mut now = page();
        change(&mut now);
        page().check(&now, true)
    }

    #[test]
    fn each_worse_figure_fails_and_each_better_one_is_told() {
        for (i, column) in COLUMNS.iter().enumerate() {
            for (worse, step) in [(true, 1i64), (false, -1)] {
                let step = if column.more_is_better { -step } else { step };
                let mut all = LARGE;
                all[i] = (all[i] as i64 + step) as u64;
                let check = checked(|now| now.rows[1].figures = figures(all));
                let line = format!("soft/large.comp STEP=2: {} {}, before {}", column.name, all[i], LARGE[i]);
                let (faults, improvements) = if worse { (vec![line], vec![]) } else { (vec![], vec![line]) };
                assert_eq!((check.faults, check.improvements), (faults, improvements));
            }
        }
        let lost = checked(|now| now.rows[0].figures.code_bytes = None);
        assert_eq!(lost.faults, ["a/small.comp: code bytes -, before 2484"]);
    }

    #[test]
    fn new_offenders_fail_and_old_ones_leave_the_list() {
        let check = checked(|now| now.rows[0].figures.scratch_bytes = Some(16));
        let expected = ["scratch bytes 16, before 0", "over the budget: scratch bytes 16 (at most 0)"];
        assert_eq!(check.faults, expected.map(|e| format!("a/small.comp: {e}")));
        let check = checked(|now| now.rows[1].figures = figures(SMALL));
        assert_eq!(
            check.faults,
            ["soft/large.comp STEP=2: not over the budget now: take it off the list of the known ones"]
        );
        assert!(check.known.is_empty() && check.improvements.len() == 5);
        // One known form of a shader excuses no other.
        let check = checked(|now| now.rows.push(row_of("soft/large.comp", "STEP=3", LARGE)));
        assert_eq!(check.faults.len(), 2);
        assert!(check.faults.iter().all(|fault| fault.starts_with("soft/large.comp STEP=3: ")), "{check:?}");
    }

    #[test]
    fn pipelines_that_come_and_go_fail() {
        let check = checked(|now| now.rows[0].form = "WIDTH=3".into());
        let expected =
            ["a/small.comp WIDTH=3: not in the table", "a/small.comp: in the table, but no technique makes it"];
        assert_eq!(check.faults, expected);
    }

    #[test]
    fn one_technique_is_held_to_its_own_rows() {
        let mut now = page();
        now.rows.truncate(1);
        assert_eq!(page().check(&now, false), Check { compared: true, ..Check::default() });
        assert_eq!(page().check(&now, true).faults.len(), 2);
        now.rows[0].figures.registers = Some(40);
        assert_eq!(page().check(&now, false).faults, ["a/small.comp: registers 40, before 32"]);
    }

    #[test]
    fn another_driver_is_held_to_the_budget_alone() {
        let check = checked(|now| {
            now.driver = "radv Mesa 25.0.7".into();
            now.rows[0].figures = figures([64, 0, 0, 5000, 16]);
            now.rows[1].figures = figures(SMALL);
        });
        assert_eq!(check, Check::default());
        let check = checked(|now| {
            now.driver = "radv Mesa 25.0.7".into();
            now.rows[0].figures.subgroups_per_simd = Some(4);
        });
        assert_eq!(check.faults, ["a/small.comp: over the budget: subgroups per SIMD 4 (at least 8)"]);
        assert_eq!((check.compared, check.known.len()), (false, 1));
        let text = check.text("radv Mesa 22.3.6", "radv Mesa 25.0.7");
        assert!(text.starts_with("NOT COMPARED: the table is of radv Mesa 22.3.6, and this is radv Mesa 25"), "{text}");
        assert!(text.contains("\nknown to be over the budget: soft/large.comp STEP=2: spilled"), "{text}");
        assert!(text.contains("\nFAULT: a/small.comp: over the budget"), "{text}");
        assert!(text.ends_with("\nfaults: 1, known: 1, better: 0\n"), "{text}");
    }
}
