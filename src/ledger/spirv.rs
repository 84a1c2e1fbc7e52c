//! What stands in SPIR-V: every read of a texture, where it stands, and how often it runs.
//!
//! How often is worked out from the module alone: loops are counted by running their induction variables with the
//! specialisation constants that the pipeline gets, and what lies behind a constant condition that does not hold is
//! left out. A condition that only the device knows is taken both ways.

use std::collections::{HashMap, HashSet};

use rspirv::dr::{Block, Function, Instruction, Loader, Module, Operand};
use rspirv::spirv::{Decoration, Dim, Op, Word};

/// Iterations after which a loop counts as endless.
const TRIPS_MAX: usize = 1 << 16;

/// How a texture is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Through a sampler, which decides between nearest and linear.
    Sample,
    /// 2x2 texels at once.
    Gather,
    /// One texel by its integer coordinates.
    Texel,
    /// One texel of a storage image.
    Storage,
    /// The pixel's own value of an input attachment.
    Input,
}

impl Kind {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Sample => "sample",
            Kind::Gather => "gather",
            Kind::Texel => "texel",
            Kind::Storage => "storage image",
            Kind::Input => "input attachment",
        }
    }
}

/// A place in the source.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The file of the shader.
    pub file: String,
    /// Its line, from 1.
    pub line: u32,
}

/// One read of a texture that stands in a shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Site {
    /// The texture's name in the shader.
    pub texture: String,
    /// How it is read.
    pub kind: Kind,
    /// Where it stands.
    pub place: Place,
    /// The function of the source that it stands in; functions are inlined in the module.
    pub function: String,
    /// Where the loops around it stand, outermost first.
    pub loops: Vec<Place>,
    /// How often it runs in one invocation, at most.
    pub trips: u64,
}

/// The reads of the entry point of a module, with `constants` as the values of its specialisation constants
/// 0, 1, ...; others keep their defaults.
///
/// `given` are the trips of loops that the module does not tell, in the order of their headers; only loops that read
/// something are asked for.
///
/// # Errors
/// A phrase, where this is no SPIR-V, or where a loop's trips are neither to be worked out nor given.
pub fn sites(words: &[u32], constants: &[u32], given: &[u64]) -> Result<Vec<Site>, String> {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(words, &mut loader).map_err(|e| format!("no SPIR-V: {e}"))?;
    let module = loader.module();
    let known = Known::new(&module, constants);
    let entry = module
        .entry_points
        .first()
        .and_then(|e| e.operands.iter().find_map(id))
        .ok_or("the module has no entry point")?;
    let mut given = given.iter().copied();
    let mut found = Vec::new();
    known.walk(&module, entry, (&[], 1), &mut given, &mut found)?;
    Ok(found)
}

fn id(operand: &Operand) -> Option<Word> {
    match operand {
        Operand::IdRef(id) => Some(*id),
        _ => None,
    }
}

/// What the module says outside its functions, and where everything is defined.
struct Known<'a> {
    defined: HashMap<Word, &'a Instruction>,
    names: HashMap<Word, &'a str>,
    bindings: HashMap<Word, u32>,
    /// Values of specialisation constants by their result.
    special: HashMap<Word, i64>,
    strings: HashMap<Word, &'a str>,
    /// Source texts by the id of their file.
    sources: HashMap<Word, String>,
}

/// The blocks of a function that can run, as a graph.
struct Graph<'a> {
    blocks: Vec<&'a Block>,
    next: Vec<Vec<usize>>,
    reachable: Vec<bool>,
}

/// Integers and truths that are known at some point, by their ids.
type Values = HashMap<Word, i64>;

/// A loop: its header, the blocks in it, and what tells how often it runs.
struct Natural {
    header: usize,
    body: HashSet<usize>,
    place: Place,
    /// Of each variable: its result, its start, and what it becomes.
    variables: Vec<(Word, Word, Word)>,
    /// Blocks that may leave the loop: the condition, and whether it leaves when that holds.
    exits: Vec<(usize, Word, bool)>,
    /// Its trips as they were given.
    given: Option<u64>,
}

/// One loop, run: the values in each full iteration, those in the last, and the block that ends that.
struct Run {
    full: Vec<Values>,
    last: Values,
    ends: usize,
}

impl<'a> Known<'a> {
    fn new(module: &'a Module, constants: &[u32]) -> Self {
        let all = module.all_inst_iter();
        let defined = all
            .filter_map(|i| Some((i.result_id?, i)))
            .collect::<HashMap<_, _>>();
        let mut names = HashMap::new();
        for i in &module.debug_names {
            if let (Op::Name, [Operand::IdRef(of), Operand::LiteralString(name)]) =
                (i.class.opcode, i.operands.as_slice())
            {
                names.insert(*of, name.as_str());
            }
        }
        let (mut bindings, mut special) = (HashMap::new(), HashMap::new());
        for i in &module.annotations {
            match i.operands.as_slice() {
                [
                    Operand::IdRef(of),
                    Operand::Decoration(Decoration::Binding),
                    Operand::LiteralBit32(n),
                ] => {
                    bindings.insert(*of, *n);
                }
                [
                    Operand::IdRef(of),
                    Operand::Decoration(Decoration::SpecId),
                    Operand::LiteralBit32(n),
                ] => {
                    if let Some(&value) = constants.get(*n as usize) {
                        special.insert(*of, i64::from(value as i32));
                    }
                }
                _ => {}
            }
        }
        let (mut strings, mut sources) = (HashMap::new(), HashMap::new());
        let mut file = 0;
        for i in &module.debug_string_source {
            match (i.class.opcode, i.result_id, i.operands.as_slice()) {
                (Op::String, Some(of), [Operand::LiteralString(text)]) => {
                    strings.insert(of, text.as_str());
                }
                (Op::Source, _, [_, _, Operand::IdRef(of), rest @ ..]) => {
                    file = *of;
                    sources.insert(file, text(rest));
                }
                (Op::SourceContinued, _, rest) => {
                    sources.entry(file).or_default().push_str(&text(rest));
                }
                _ => {}
            }
        }
        Known {
            defined,
            names,
            bindings,
            special,
            strings,
            sources,
        }
    }

    /// Adds the reads of `function` to `found`, which is called so many times within the loops `around`.
    fn walk(
        &self,
        module: &Module,
        function: Word,
        (around, calls): (&[Place], u64),
        given: &mut dyn Iterator<Item = u64>,
        found: &mut Vec<Site>,
    ) -> Result<(), String> {
        let defines = |f: &&Function| {
            f.def
                .as_ref()
                .is_some_and(|d| d.result_id == Some(function))
        };
        let Some(function) = module.functions.iter().find(defines) else {
            return Err("a function is called that the module does not hold".to_owned());
        };
        let graph = self.graph(function);
        let mut loops = self.loops(&graph);
        for (at, block) in graph.blocks.iter().enumerate() {
            let reads = |i: &Instruction| {
                kind(i.class.opcode).is_some() || i.class.opcode == Op::FunctionCall
            };
            if !graph.reachable[at] || !block.instructions.iter().any(reads) {
                continue;
            }
            let mut inside: Vec<_> = loops.iter_mut().filter(|l| l.body.contains(&at)).collect();
            inside.sort_by_key(|l| std::cmp::Reverse(l.body.len()));
            let runs = calls * self.runs(&graph, &mut inside, &Values::new(), at, given)?;
            let mut places = around.to_vec();
            places.extend(inside.iter().map(|l| l.place.clone()));
            let mut line = None;
            for i in &block.instructions {
                match i.class.opcode {
                    Op::Line => line = Some(i),
                    Op::NoLine => line = None,
                    Op::FunctionCall => {
                        let callee = i.operands.first().and_then(id).unwrap_or(0);
                        self.walk(module, callee, (&places, runs), given, found)?;
                    }
                    opcode => {
                        let Some(kind) = kind(opcode) else { continue };
                        found.push(self.site(i, kind, line, (places.clone(), runs)));
                    }
                }
            }
        }
        Ok(())
    }

    /// How often block `at` runs in the loops `inside`, outermost first, where `now` is known.
    fn runs(
        &self,
        graph: &Graph<'_>,
        inside: &mut [&mut Natural],
        now: &Values,
        at: usize,
        given: &mut dyn Iterator<Item = u64>,
    ) -> Result<u64, String> {
        let Some((outer, inner)) = inside.split_first_mut() else {
            return Ok(1);
        };
        let Some(run) = self.run(outer, now) else {
            let trips = outer.given.or_else(|| given.next());
            outer.given = trips;
            let Place { file, line } = &outer.place;
            let trips = trips.ok_or_else(|| {
                format!("{file}:{line}: how often this loop runs only the device knows")
            })?;
            return Ok(trips * self.runs(graph, inner, now, at, given)?);
        };
        let mut sum = 0;
        for now in &run.full {
            sum += self.runs(graph, inner, now, at, given)?;
        }
        if graph.leads(outer, at, run.ends) {
            sum += self.runs(graph, inner, &run.last, at, given)?;
        }
        Ok(sum)
    }

    fn site(
        &self,
        read: &Instruction,
        kind: Kind,
        line: Option<&Instruction>,
        (loops, trips): (Vec<Place>, u64),
    ) -> Site {
        let image = read.operands.first().and_then(id).unwrap_or(0);
        let kind = if self.is_input(image) {
            Kind::Input
        } else {
            kind
        };
        let place = self.place(line);
        let function = self.function(line).unwrap_or_else(|| "main".to_owned());
        Site {
            texture: self.texture(image),
            kind,
            place,
            function,
            loops,
            trips,
        }
    }

    /// Whether the image `value` is of an input attachment.
    fn is_input(&self, value: Word) -> bool {
        let of = |value: Word| self.defined.get(&value).copied();
        let kind = of(value).and_then(|i| i.result_type).and_then(of);
        kind.is_some_and(|i| i.operands.contains(&Operand::Dim(Dim::DimSubpassData)))
    }

    /// The name of the variable that the image `value` was loaded from.
    fn texture(&self, mut value: Word) -> String {
        // Through loads, samplers and images taken out of sampled images.
        while let Some(i) = self.defined.get(&value) {
            match (i.class.opcode, i.operands.first().and_then(id)) {
                (Op::Variable, _) | (_, None) => break,
                (_, Some(from)) => value = from,
            }
        }
        let name = self.names.get(&value).filter(|name| !name.is_empty());
        name.map_or_else(
            || {
                let binding = self.bindings.get(&value);
                binding.map_or("unnamed".to_owned(), |n| format!("binding {n}"))
            },
            |name| (*name).to_owned(),
        )
    }

    fn place(&self, line: Option<&Instruction>) -> Place {
        let (file, line) = line_of(line).unwrap_or((0, 0));
        Place {
            file: self.strings.get(&file).copied().unwrap_or("").to_owned(),
            line,
        }
    }

    /// The function whose body the line lies in: the last line before it that opens one in column 0.
    fn function(&self, line: Option<&Instruction>) -> Option<String> {
        let (file, line) = line_of(line)?;
        let before = self.sources.get(&file)?.lines().take(line as usize);
        let opens = |l: &&str| {
            l.starts_with(|c: char| c.is_alphabetic()) && l.contains('(') && l.ends_with('{')
        };
        let head = before.filter(opens).last()?;
        let name = head.split('(').next()?.split_whitespace().last()?;
        Some(name.to_owned())
    }

    fn graph<'b>(&self, function: &'b Function) -> Graph<'b> {
        let blocks: Vec<_> = function.blocks.iter().collect();
        let index: HashMap<_, _> = (0..)
            .zip(&blocks)
            .filter_map(|(at, b): (usize, _)| Some((b.label.as_ref()?.result_id?, at)))
            .collect();
        let next: Vec<Vec<usize>> = blocks
            .iter()
            .map(|block| {
                let labels = block.instructions.last().map(|i| self.targets(i));
                let labels = labels.unwrap_or_default();
                labels
                    .iter()
                    .filter_map(|l| index.get(l).copied())
                    .collect()
            })
            .collect();
        let mut reachable = vec![false; blocks.len()];
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            if at < blocks.len() && !std::mem::replace(&mut reachable[at], true) {
                open.extend(&next[at]);
            }
        }
        Graph {
            blocks,
            next,
            reachable,
        }
    }

    /// Where a block's last instruction goes; only where it does go, if its condition is constant.
    fn targets(&self, last: &Instruction) -> Vec<Word> {
        let ids: Vec<_> = last.operands.iter().filter_map(id).collect();
        let none = Values::new();
        match (last.class.opcode, ids.as_slice()) {
            (Op::Branch, [to, ..]) => vec![*to],
            (Op::BranchConditional, [condition, yes, no, ..]) => {
                match self.value(*condition, &none) {
                    Some(0) => vec![*no],
                    Some(_) => vec![*yes],
                    None => vec![*yes, *no],
                }
            }
            (Op::Switch, [selector, default, cases @ ..]) => {
                let literals = last.operands.iter().filter_map(|o| match o {
                    Operand::LiteralBit32(n) => Some(i64::from(*n as i32)),
                    _ => None,
                });
                match self.value(*selector, &none) {
                    Some(value) => {
                        let hit = literals.zip(cases).find(|(literal, _)| *literal == value);
                        vec![hit.map_or(*default, |(_, to)| *to)]
                    }
                    None => ids[1..].to_vec(),
                }
            }
            _ => Vec::new(),
        }
    }

    fn loops(&self, graph: &Graph<'_>) -> Vec<Natural> {
        let mut found = Vec::new();
        for (header, block) in graph.blocks.iter().enumerate() {
            let merges = |i: &Instruction| i.class.opcode == Op::LoopMerge;
            if !graph.reachable[header] || !block.instructions.iter().any(merges) {
                continue;
            }
            // Blocks come after those that dominate them: an edge that goes back ends a loop.
            let latch = (header..graph.blocks.len())
                .find(|&b| graph.reachable[b] && graph.next[b].contains(&header));
            let Some(latch) = latch else {
                // It never comes round.
                continue;
            };
            let line = block
                .instructions
                .iter()
                .rfind(|i| i.class.opcode == Op::Line);
            let body = graph.body(header, latch);
            found.push(Natural {
                header,
                place: self.place(line),
                variables: variables(block, graph.label(latch)),
                exits: graph.exits(&body),
                body,
                given: None,
            });
        }
        found
    }

    /// Runs the loop's variables until one of its conditions ends it; none where what is known does not tell when.
    fn run(&self, natural: &Natural, outside: &Values) -> Option<Run> {
        let next = |now: &Values, of: &dyn Fn(&(Word, Word, Word)) -> Word| {
            let mut values = outside.clone();
            for variable in &natural.variables {
                match self.value(of(variable), now) {
                    Some(value) => values.insert(variable.0, value),
                    None => values.remove(&variable.0),
                };
            }
            values
        };
        let mut now = next(outside, &|variable| variable.1);
        let mut full = Vec::new();
        while full.len() < TRIPS_MAX {
            let mut known = false;
            for &(ends, condition, leaves) in &natural.exits {
                if let Some(value) = self.value(condition, &now) {
                    known = true;
                    if (value != 0) == leaves {
                        return Some(Run {
                            full,
                            last: now,
                            ends,
                        });
                    }
                }
            }
            if !known {
                return None;
            }
            let then = next(&now, &|variable| variable.2);
            full.push(std::mem::replace(&mut now, then));
        }
        None
    }

    /// The value of an integer or truth that follows from constants and `now`.
    fn value(&self, of: Word, now: &Values) -> Option<i64> {
        if let Some(&value) = now.get(&of).or_else(|| self.special.get(&of)) {
            return Some(value);
        }
        let i = self.defined.get(&of)?;
        let (opcode, operands) = match (i.class.opcode, i.operands.as_slice()) {
            (Op::ConstantTrue | Op::SpecConstantTrue, _) => return Some(1),
            (Op::ConstantFalse | Op::SpecConstantFalse, _) => return Some(0),
            (Op::Constant | Op::SpecConstant, [Operand::LiteralBit32(n)]) => {
                return Some(i64::from(*n as i32));
            }
            (Op::SpecConstantOp, [Operand::LiteralSpecConstantOpInteger(op), rest @ ..]) => {
                (*op, rest)
            }
            (op, operands) => (op, operands),
        };
        let foldable = |op| {
            use Op::*;
            matches!(
                op,
                IAdd | ISub
                    | IMul
                    | SDiv
                    | UDiv
                    | SLessThan
                    | ULessThan
                    | SLessThanEqual
                    | ULessThanEqual
                    | SGreaterThan
                    | UGreaterThan
                    | SGreaterThanEqual
                    | UGreaterThanEqual
                    | IEqual
                    | INotEqual
                    | LogicalAnd
                    | LogicalOr
                    | LogicalNot
                    | Select
            )
        };
        if !foldable(opcode) {
            return None;
        }
        let values: Vec<Option<i64>> = operands
            .iter()
            .filter_map(id)
            .map(|of| self.value(of, now))
            .collect();
        let truth = |holds: bool| Some(i64::from(holds));
        // One side alone may decide.
        if opcode == Op::LogicalAnd && values.contains(&Some(0)) {
            return truth(false);
        }
        if opcode == Op::LogicalOr && values.iter().flatten().any(|&v| v != 0) {
            return truth(true);
        }
        let values: Vec<i64> = values.into_iter().collect::<Option<_>>()?;
        match (opcode, values.as_slice()) {
            (Op::IAdd, [a, b]) => Some(a + b),
            (Op::ISub, [a, b]) => Some(a - b),
            (Op::IMul, [a, b]) => a.checked_mul(*b),
            (Op::SDiv | Op::UDiv, [a, b]) => a.checked_div(*b),
            (Op::SLessThan | Op::ULessThan, [a, b]) => truth(a < b),
            (Op::SLessThanEqual | Op::ULessThanEqual, [a, b]) => truth(a <= b),
            (Op::SGreaterThan | Op::UGreaterThan, [a, b]) => truth(a > b),
            (Op::SGreaterThanEqual | Op::UGreaterThanEqual, [a, b]) => truth(a >= b),
            (Op::IEqual, [a, b]) => truth(a == b),
            (Op::INotEqual, [a, b]) => truth(a != b),
            (Op::LogicalAnd, [a, b]) => truth(*a != 0 && *b != 0),
            (Op::LogicalOr, [a, b]) => truth(*a != 0 || *b != 0),
            (Op::LogicalNot, [a]) => truth(*a == 0),
            (Op::Select, [c, a, b]) => Some(if *c != 0 { *a } else { *b }),
            _ => None,
        }
    }
}

impl Graph<'_> {
    fn label(&self, at: usize) -> Option<Word> {
        self.blocks[at].label.as_ref()?.result_id
    }

    fn at(&self, label: Word) -> Option<usize> {
        (0..self.blocks.len()).find(|&at| self.label(at) == Some(label))
    }

    /// The blocks from which `latch` is reached without passing `header`, and both.
    fn body(&self, header: usize, latch: usize) -> HashSet<usize> {
        let mut body = HashSet::from([header]);
        let mut open = vec![latch];
        while let Some(at) = open.pop() {
            if body.insert(at) {
                let before = |b: &usize| self.reachable[*b] && self.next[*b].contains(&at);
                open.extend((0..self.blocks.len()).filter(before));
            }
        }
        body
    }

    /// The blocks of `body` that may leave it.
    fn exits(&self, body: &HashSet<usize>) -> Vec<(usize, Word, bool)> {
        let mut exits = Vec::new();
        for &at in body {
            let Some(last) = self.blocks[at].instructions.last() else {
                continue;
            };
            let ids: Vec<_> = last.operands.iter().filter_map(id).collect();
            if let (Op::BranchConditional, [condition, yes, no, ..]) =
                (last.class.opcode, ids.as_slice())
            {
                let outside = |label| self.at(label).is_none_or(|b| !body.contains(&b));
                match (outside(*yes), outside(*no)) {
                    (true, false) => exits.push((at, *condition, true)),
                    (false, true) => exits.push((at, *condition, false)),
                    _ => {}
                }
            }
        }
        exits.sort_unstable_by_key(|exit| exit.0);
        exits
    }

    /// Whether block `at` comes before block `to`, or is it, within one iteration of a loop.
    fn leads(&self, natural: &Natural, at: usize, to: usize) -> bool {
        let mut open = vec![at];
        let mut seen = HashSet::new();
        while let Some(b) = open.pop() {
            if b == to {
                return true;
            }
            if seen.insert(b) {
                let onward = |n: &&usize| natural.body.contains(n) && **n != natural.header;
                open.extend(self.next[b].iter().filter(onward));
            }
        }
        false
    }
}

/// The variables of the loop that `header` opens and the block `latch` closes.
fn variables(header: &Block, latch: Option<Word>) -> Vec<(Word, Word, Word)> {
    let phis = header
        .instructions
        .iter()
        .filter(|i| i.class.opcode == Op::Phi);
    phis.filter_map(|i| {
        let ids: Vec<_> = i.operands.iter().filter_map(id).collect();
        let pairs = || ids.chunks_exact(2).map(|p| (p[0], p[1]));
        let (step, _) = pairs().find(|(_, from)| Some(*from) == latch)?;
        let (start, _) = pairs().find(|(_, from)| Some(*from) != latch)?;
        Some((i.result_id?, start, step))
    })
    .collect()
}

/// How an instruction reads a texture, if it does.
fn kind(opcode: Op) -> Option<Kind> {
    let name = format!("{opcode:?}");
    let name = name
        .strip_prefix("ImageSparse")
        .or(name.strip_prefix("Image"))?;
    if name.starts_with("Sample") {
        Some(Kind::Sample)
    } else if name.starts_with("Gather") || name.starts_with("DrefGather") {
        Some(Kind::Gather)
    } else if name.starts_with("Fetch") {
        Some(Kind::Texel)
    } else if name.starts_with("Read") {
        Some(Kind::Storage)
    } else {
        None
    }
}

fn line_of(line: Option<&Instruction>) -> Option<(Word, u32)> {
    match line?.operands.as_slice() {
        [Operand::IdRef(file), Operand::LiteralBit32(line), ..] => Some((*file, *line)),
        _ => None,
    }
}

fn text(operands: &[Operand]) -> String {
    let texts = operands.iter().filter_map(|o| match o {
        Operand::LiteralString(text) => Some(text.as_str()),
        _ => None,
    });
    texts.collect()
}
