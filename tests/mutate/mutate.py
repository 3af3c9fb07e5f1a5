#!/usr/bin/env python3
"""./dev mutate: puts mistakes into a copy of the sources and asks which tests notice them.

All mutants are in one build and are switched on one at a time (Untch, Offutt & Harrold (1993), Mutation analysis
using mutant schemata, ISSTA 139-148), each against tests that reach it, quick ones that reach little else first, for
as many seconds of tests as said, and those that survive against all that are left. Results are kept in build/mutate:
a call goes on where the last one stopped, and asks of the survivors the tests whose files have changed.
"""

import collections
import concurrent.futures
import contextlib
import difflib
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import points

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / 'build' / 'mutate'
SOURCE, TREE, OUT = WORK / 'source', WORK / 'tree', WORK / 'out'  # as it was, with mutants, built
FOLDERS = ('core', 'plugins', 'cli')
TARGETS = ('sim', 'simrepl', 'plugins', 'sim_tests', 'sim_hunt', 'sim_c_interface')
SHOWN = {'browser', 'window'}  # labels of tests that take long and are asked of what is shown alone
SHOWING = ('cli/view', 'plugins/view', 'core/output/page', 'core/picture')
LONGEST = 75.0  # s, of a processor; tests that take longer are not asked
BATCH, JOBS = 4.0, os.cpu_count() or 1  # s, of test cases that run in one process; processes at a time

def say(text):
    print(f'mutate: {text}', file=sys.stderr, flush=True)

def fail(text, code=1):
    print(f'dev: error: {text}', file=sys.stderr)
    sys.exit(code)

def sources(root):
    for top in FOLDERS:
        for path in sorted((root / top).rglob('*')):
            if path.suffix in ('.h', '.cpp') and path.name != 'mutants.cpp':
                yield path.relative_to(root).as_posix(), path

def flags():
    wanted = ('lua5.4-c++', 'eigen3', 'hdf5-serial', 'glfw3', 'imgui', 'libedit')
    found = [subprocess.run(['pkg-config', '--cflags-only-I', name], capture_output=True, text=True) for name in wanted]
    return ['-xc++', '-std=c++20', '-w', f'-I{SOURCE}', '-include', f'{TREE}/tests/mutate/mutants.h',
            *' '.join(each.stdout for each in found).split()]

def including(path, text):
    """A file that is compiled and reads a header that cannot be read alone; or None."""
    if path.suffix == '.h' and b'SIM_TARGET_BEGIN' in text:
        name = path.relative_to(SOURCE).as_posix()
        kernels = sorted(SOURCE.glob('[cp]*/**/*_kernel.cpp'))
        return str(next((kernel for kernel in kernels if name in kernel.read_text()), kernels[0]))

def changed(source, chosen):
    """The source with all of the chosen (number, point) in it."""
    edits = [(p.start, p.end, p.choice(number, source).encode()) for number, p in chosen]
    for at, member in {tuple(p.constant) for _, p in chosen if p.constant}:
        edits.append((at, at + len(b'constexpr'), b'inline const' if member else b'const'))
    for start, end, text in sorted(edits, reverse=True):
        source = source[:start] + text + source[end:]
    return source

def choose(task):
    """Some points of a file that do not overlap and compile with libclang."""
    name, count, seed = task
    path, dice, by_rule, chosen = SOURCE / name, random.Random(f'{seed} {name}'), collections.defaultdict(list), []
    unit = points.Unit(str(path), [*flags(), f'-I{path.parent}'], including(path, path.read_bytes()))
    for point in unit.points():
        by_rule[point.rule].append(point)
    for _ in range(40 * count if by_rule else 0):
        point = dice.choice(by_rule[dice.choice(sorted(by_rule))])
        if len(chosen) <= count + count // 4 and all(point.end <= p.start or p.end <= point.start for p in chosen):
            chosen.append(point)
    while chosen and (wrong := unit.wrong_lines(changed(unit.source, list(enumerate(chosen, 1))).decode())):
        kept = [p for p in chosen if not wrong & set(p.lines(unit.source))]
        chosen = kept if len(kept) < len(chosen) else []
    return [(name, point) for point in chosen[:count]]

def draw(count, seed, folder):
    """Mutants by number, in the order in which they are tried."""
    sizes = {name: sum(bool(line.strip()) and not line.lstrip().startswith(('//', '#'))
                       for line in path.read_text().splitlines())
             for name, path in sources(SOURCE) if name.startswith(folder)}
    if not sizes:
        fail(f"no sources in '{folder}'; a folder of {', '.join(FOLDERS)} is meant, as core/ode", 2)
    dice = random.Random(seed)
    wanted = collections.Counter(dice.choices(list(sizes), list(sizes.values()), k=count + 5 + count // 8))
    with concurrent.futures.ProcessPoolExecutor(JOBS) as pool:
        say(f'reading {len(wanted)} files')
        mutants = sum(pool.map(choose, [(name, k, seed) for name, k in sorted(wanted.items())]), [])
    dice.shuffle(mutants)
    return dict(enumerate(mutants[:count], 1))

def copy_tree():
    for copy in (SOURCE, TREE):
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(ROOT, copy, symlinks=True, ignore=lambda folder, names: {
            n for n in names if n in ('.git', '__pycache__') or (n == 'build' and pathlib.Path(folder) == ROOT)})
    shutil.copy(TREE / 'tests/mutate/mutants.cpp.in', TREE / 'core/base/mutants.cpp')
    with open(TREE / 'cli/CMakeLists.txt', 'a') as file:  # the program without the kernel
        file.write('if(TARGET sim-petsc)\n  target_sources(sim-petsc PRIVATE ../core/base/mutants.cpp)\nendif()\n')

def renew_tests():
    """Copies the tests that have changed; the names of their cases, and of files that are no cases."""
    changed, old = set(), {path for path in (TREE / 'tests').rglob('*') if path.is_file()}
    for path in (ROOT / 'tests').rglob('*'):
        copy = TREE / path.relative_to(ROOT)
        old.discard(copy)
        if not path.is_file() or '__pycache__' in path.parts or \
                (copy.exists() and copy.read_bytes() == path.read_bytes()):
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
        text = re.sub(r'"\s*\n\s*"', '', path.read_text(errors='replace'))
        named = re.findall(r'TEST_CASE\(\s*"((?:[^"\\]|\\.)*)"', text)
        changed |= {'case ' + re.sub(r'\\(.)', r'\1', name) for name in named} | {path.name}
    for path in old:
        path.unlink()
    return changed

def ninja():
    window = ['sim_silhouette'] if 'build sim_silhouette:' in (OUT / 'build.ninja').read_text() else []
    with open(WORK / 'build.log', 'w') as log:
        return subprocess.run(['ninja', '-C', OUT, '-k', '0', '-j', str(JOBS), *TARGETS, *window], stdout=log,
                              stderr=subprocess.STDOUT).returncode == 0

def write_mutants(mutants):
    by_file = collections.defaultdict(list)
    for number, (name, point) in mutants.items():
        by_file[name].append((number, point))
    for name, path in sources(SOURCE):
        text = changed(path.read_bytes(), by_file[name])
        if text != (TREE / name).read_bytes():
            (TREE / name).write_bytes(text)

def build(mutants):
    """Builds the tree; mutants that do not compile are dropped from the list."""
    configured = subprocess.run(
        ['cmake', '-S', TREE, '-B', OUT, '-G', 'Ninja', '-DCMAKE_BUILD_TYPE=Release',
         '-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG', f'-DCMAKE_CXX_FLAGS=-w -include {TREE}/tests/mutate/mutants.h'],
        capture_output=True, text=True)
    if configured.returncode != 0:
        fail(f'the copy could not be configured:\n{configured.stderr}')
    while True:
        write_mutants(mutants)
        say(f'building with {len(mutants)} mutants; {WORK}/build.log')
        if ninja():
            return
        at, beside = set(), set()
        for where, line in re.findall(r'^(\S+?):(\d+):\d+: error:', (WORK / 'build.log').read_text(), re.M):
            name = os.path.relpath(os.path.join(OUT, where), TREE)
            here = {n for n, (file, _) in mutants.items() if file == name}
            at |= {n for n in here if int(line) in mutants[n][1].lines((SOURCE / name).read_bytes())}
            beside |= here
        if not at | beside:
            fail(f'the build failed, and no mutant is to blame: {WORK}/build.log')
        for number in at or beside:
            say(f'{number} in {mutants.pop(number)[0]} does not compile and is dropped')

def run(names, commands, timeout, seconds, **environment):
    """Whether a program or some cases of sim_tests pass in `timeout` s, `seconds` of a processor; what they took of
    it, and whether they were still running at the end of the time."""
    def limit():  # A mutant may ask for any amount; of addresses alone, a browser does.
        for kind, most in (('DATA', 12 << 30), ('FSIZE', 4 << 30), ('CPU', int(seconds))):
            resource.setrlimit(getattr(resource, 'RLIMIT_' + kind), (most, most))
    with tempfile.TemporaryDirectory(dir=WORK / 'tmp') as folder:
        command = commands[names[0]]
        if not command:
            cases = pathlib.Path(folder) / 'cases'
            cases.write_text(''.join('"%s"\n' % n[5:].replace('\\', r'\\').replace(',', r'\,') for n in names))
            command = [OUT / 'bin/sim_tests', '--abort', '--warn', 'NoTests', '--input-file', cases]
        process = subprocess.Popen(command, env={**os.environ, 'TMPDIR': folder, **environment}, cwd=OUT / 'tests',
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   start_new_session=True, preexec_fn=limit)
        end = time.monotonic() + timeout
        while not (ended := os.wait4(process.pid, os.WNOHANG))[0] and time.monotonic() < end:
            time.sleep(0.01)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        ended = ended if ended[0] else os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(ended[1])
        late = process.returncode == -signal.SIGKILL and time.monotonic() >= end
        return process.returncode in (0, 77), ended[2].ru_utime + ended[2].ru_stime, late

def tests():
    """The command of each test that is a program, none for a case of sim_tests; those of what is shown."""
    shown = subprocess.run(['ctest', '--test-dir', OUT, '--show-only=json-v1'], capture_output=True, check=True).stdout
    found, shown_alone = {}, set()
    for test in json.loads(shown)['tests']:
        labels = {label for p in test.get('properties', []) if p['name'] == 'LABELS' for label in p['value']}
        if 'command' in test and not test['command'][0].endswith('/sim_tests') and 'slow' not in labels:
            found[test['name']] = test['command']
            shown_alone |= {test['name']} if labels & SHOWN else set()
    listed = subprocess.run([OUT / 'bin/sim_tests', '--list-test-names-only'], capture_output=True, text=True).stdout
    return found | {f'case {line}': None for line in listed.splitlines() if line.strip()}, shown_alone

def reach_of(name, commands):
    with tempfile.NamedTemporaryFile(dir=WORK / 'tmp') as file:
        file.truncate(1 << 16)
        passed, seconds, _ = run([name], commands, 20 * LONGEST, LONGEST, SIM_MUTANT_REACHED=file.name)
        return name, passed, seconds, [i for i, byte in enumerate(pathlib.Path(file.name).read_bytes()) if byte]

def read_lines(path):
    return {key: rest for key, *rest in map(json.loads, path.read_text().splitlines())} if path.exists() else {}

def find_reach(commands, changed):
    """{name: (seconds, reached)} of tests that pass without a mutant, and the names that are new or changed."""
    path = WORK / 'reach.jsonl'
    found = read_lines(path)
    new = [name for name, command in commands.items()
           if name not in found or name in changed or {pathlib.Path(str(word)).name for word in command or ()} & changed]
    say(f'{len(new)} tests show what they reach')
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool, open(path, 'a') as file:
        for name, *rest in pool.map(lambda test: reach_of(test, commands), new):
            found[name] = rest
            print(json.dumps([name, *rest]), file=file, flush=True)
    failing = [name for name, (passed, *_) in found.items() if not passed and name in commands]
    if failing:
        say(f'{len(failing)} tests fail or take long without a mutant and are not asked: ' + '; '.join(failing))
    return {name: rest[1:] for name, rest in found.items() if rest[0] and name in commands}, new

def most_telling(names, reach, first, budget):
    """The tests that are to be asked first, then quick ones that reach few mutants, while the budget lasts."""
    seconds = 0.0
    for name in sorted(names, key=lambda name: (name not in first, (reach[name][0] + 0.02) * len(reach[name][1]))):
        if name in first or seconds + reach[name][0] <= budget:
            seconds += reach[name][0]
            yield name

def batches(names, reach, commands):
    """Cases together while they take no longer than BATCH."""
    together, seconds = [], 0.0
    for name in names:
        if together and (commands[name] or commands[together[0]] or seconds + reach[name][0] > BATCH):
            yield together, seconds
            together, seconds = [], 0.0
        together.append(name)
        seconds += reach[name][0]
    if together:
        yield together, seconds

def notices(number, names, seconds, commands):
    """Whether tests fail with a mutant and pass without it. Those that wait for ever have no time but the clock's,
    which is set by what they take without the mutant, whatever else the machine does."""
    most, clock = 20 * seconds + 30, 60 * seconds + 90
    while True:
        passed, _, late = run(names, commands, clock, most, SIM_MUTANT=str(number))
        if passed:
            return False
        start = time.monotonic()
        if not run(names, commands, clock, most)[0]:
            say(f'{names[0]} .. {names[-1]} sometimes fails without a mutant')
            return False
        if not late or clock > 10 * (time.monotonic() - start):
            return True
        clock *= 4

def try_mutant(number, names, reach, commands):
    """Which of the tests notices a mutant, if any."""
    for together, seconds in batches(names, reach, commands):
        if notices(number, together, seconds, commands):
            return f'{together[0]} .. {together[-1]}' if len(together) > 1 else together[0]

def patch(name, point):
    before = (SOURCE / name).read_bytes()
    after = before[:point.start] + point.text.encode() + before[point.end:]
    return ''.join(difflib.unified_diff(before.decode().splitlines(True), after.decode().splitlines(True),
                                        f'a/{name}', f'b/{name}', n=2))

def report(mutants, results, reach):
    rooms = collections.defaultdict(list)
    for number, (asked, by) in sorted(results.items()):
        name, point = mutants[number]
        for room in ('/'.join(name.split('/')[:2]), 'all'):
            rooms[room].append(by is not None)
        if by is None:
            reaching = sum(number in reached for _, reached in reach.values())
            print(f'--- mutant {number} ({point.rule}) passed {len(asked)} of {reaching} tests\n{patch(name, point)}')
    for room in [*sorted(rooms.keys() - {'all'}), 'all']:
        print(f'{room:24} noticed {sum(rooms[room]):3} of {len(rooms[room]):3}, '
              f'{100 * sum(rooms[room]) / len(rooms[room]):5.1f} %')

def arguments():
    words = re.fullmatch(r'(\d+(?: |$))?(\d+(?: |$))?([a-z]\S*(?: |$))?(\d+s)?', ' '.join(sys.argv[1:]))
    if not words or not 0 < int(words[1] or 50) < 1 << 15:
        fail('usage: ./dev mutate [N [SEED]] [FOLDER] [SECONDSs], as ./dev mutate 200 1 core/ode 20s', 2)
    key = [int(words[1] or 50), int(words[2] or 1), (words[3] or '').rstrip('/ ')]
    return key, float((words[4] or 'inf').rstrip('s'))

def main():
    key, budget = arguments()
    shutil.rmtree(WORK / 'tmp', ignore_errors=True)
    (WORK / 'tmp').mkdir(parents=True)
    state, kept = WORK / 'state.json', WORK / 'results.jsonl'
    known = json.loads(state.read_text()) if state.exists() else {}
    if known.get('key') == key:
        say('goes on where it stopped; remove build/mutate/state.json to begin anew')
        mutants = {int(n): (name, points.Point(**fields)) for n, (name, fields) in known['mutants'].items()}
        changed = renew_tests()
        if not ninja():
            fail(f'the tests do not compile: {WORK}/build.log')
    else:
        for path in (state, kept, WORK / 'reach.jsonl'):
            path.unlink(missing_ok=True)
        copy_tree()
        changed, mutants = set(), draw(*key)
        build(mutants)
        state.write_text(json.dumps({'key': key, 'mutants': {n: [m, vars(p)] for n, (m, p) in mutants.items()}}))

    commands, shown = tests()
    reach, new = find_reach(commands, changed)
    lines = (WORK / 'reach.jsonl').read_text().splitlines()
    place = {json.loads(line)[0]: i for i, line in enumerate(lines)}  # of a test as it is now, in results
    results = read_lines(kept)
    first = set(new) if results else set()
    for most in sorted({budget, float('inf')}):
        with concurrent.futures.ThreadPoolExecutor(JOBS) as pool, open(kept, 'a') as file:
            asked = {}
            for number, (name, _) in mutants.items():
                before, by = results.get(number, ([], None))
                left = [test for test, (_, reached) in reach.items() if number in reached and
                        place[test] not in before and (test not in shown or name.startswith(SHOWING))]
                tests_now = list(most_telling(left, reach, first, most))
                if by is None and (tests_now or number not in results):
                    asked[pool.submit(try_mutant, number, tests_now, reach, commands)] = number, before, tests_now
            for done in concurrent.futures.as_completed(asked):
                (number, before, tests_now), by = asked[done], done.result()
                results[number] = [before + [place[test] for test in tests_now], by]
                print(json.dumps([number, *results[number]]), file=file, flush=True)
                say(f'{number} {"noticed by " + by if by else "PASSED"}; {len(results)} of {len(mutants)}')
    report(mutants, results, reach)

if __name__ == '__main__':
    main()
