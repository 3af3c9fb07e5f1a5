#!/usr/bin/env python3
"""./dev mutate: puts mistakes into a copy of the sources and asks which tests notice them.

All mutants are in one build and are switched on one at a time (Untch, Offutt & Harrold (1993), Mutation analysis
using mutant schemata, ISSTA 139-148), each against the tests that reach it, quick ones first. Results are kept in
build/mutate: an interrupted call goes on where it stopped, and survivors are tried again on tests that are new.
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
TARGETS = ('sim', 'simrepl', 'plugins', 'sim_tests', 'sim_hunt')
LEFT_OUT = {'slow', 'browser', 'window'}  # labels of tests that are not asked
BATCH = 4.0  # s, of test cases that run in one process
JOBS = os.cpu_count() or 1

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
    wanted = ('lua5.4-c++', 'eigen3', 'libwebsockets', 'hdf5-serial', 'glfw3', 'imgui', 'libedit')
    found = [subprocess.run(['pkg-config', '--cflags-only-I', name], capture_output=True, text=True) for name in wanted]
    return ['-xc++', '-std=c++20', '-w', f'-I{SOURCE}', '-include', f'{TREE}/tests/mutate/mutants.h',
            *' '.join(each.stdout for each in found).split()]

def including(path, text):
    """A file that is compiled and reads a header that cannot be read alone; or None."""
    if path.suffix == '.h' and b'SIM_TARGET_BEGIN' in text:
        name = path.relative_to(SOURCE).as_posix()
        kernels = sorted(SOURCE.glob('core/**/*_kernel.cpp'))
        return str(next((kernel for kernel in kernels if name in kernel.read_text()), kernels[0]))
    return None

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
    unit = points.Unit(str(path), flags(), including(path, path.read_bytes()))
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

def ninja():
    with open(WORK / 'build.log', 'w') as log:
        return subprocess.run(['ninja', '-C', OUT, '-k', '0', '-j', str(JOBS), *TARGETS], stdout=log,
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

def limit():
    """A mutant may ask for any amount."""
    resource.setrlimit(resource.RLIMIT_AS, (12 << 30, 12 << 30))
    resource.setrlimit(resource.RLIMIT_FSIZE, (4 << 30, 4 << 30))

def run(names, commands, timeout, **environment):
    """True where a program, or some cases of sim_tests, pass in time; and how long they took, in s."""
    with tempfile.TemporaryDirectory(dir=WORK / 'tmp') as folder:
        command = commands[names[0]]
        if not command:
            cases = pathlib.Path(folder) / 'cases'
            words = (name[5:].replace('\\', r'\\').replace(',', r'\,') for name in names)
            cases.write_text(''.join(f'"{text}"\n' for text in words))
            command = [OUT / 'bin/sim_tests', '--abort', '--warn', 'NoTests', '--input-file', cases]
        start = time.monotonic()
        process = subprocess.Popen(command, env={**os.environ, 'TMPDIR': folder, **environment}, cwd=OUT / 'tests',
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   start_new_session=True, preexec_fn=limit)
        try:
            passed = process.wait(timeout) in (0, 77)
        except subprocess.TimeoutExpired:
            passed = False
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return passed, time.monotonic() - start

def tests():
    """The command of each test that is a program; none for a case of sim_tests."""
    shown = subprocess.run(['ctest', '--test-dir', OUT, '--show-only=json-v1'], capture_output=True, check=True).stdout
    found = {}
    for test in json.loads(shown)['tests']:
        labels = {label for p in test.get('properties', []) if p['name'] == 'LABELS' for label in p['value']}
        if 'command' in test and not test['command'][0].endswith('/sim_tests') and not labels & LEFT_OUT:
            found[test['name']] = test['command']
    listed = subprocess.run([OUT / 'bin/sim_tests', '--list-test-names-only'], capture_output=True, text=True).stdout
    return found | {f'case {line}': None for line in listed.splitlines() if line.strip()}

def reach_of(name, commands):
    with tempfile.NamedTemporaryFile(dir=WORK / 'tmp') as file:
        file.truncate(1 << 16)
        passed, seconds = run([name], commands, 1500, SIM_MUTANT_REACHED=file.name)
        return name, passed, seconds, [i for i, byte in enumerate(pathlib.Path(file.name).read_bytes()) if byte]

def read_lines(path):
    return {key: rest for key, *rest in map(json.loads, path.read_text().splitlines())} if path.exists() else {}

def find_reach(commands):
    """{name: (seconds, reached)} of the tests that pass without a mutant, and the names that are new."""
    path = WORK / 'reach.jsonl'
    found = read_lines(path)
    new = [name for name in commands if name not in found]
    say(f'{len(new)} tests show what they reach')
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool, open(path, 'a') as file:
        for n, (name, *rest) in enumerate(pool.map(lambda test: reach_of(test, commands), new), 1):
            found[name] = rest
            print(json.dumps([name, *rest]), file=file, flush=True)
            if n % 100 == 0:
                say(f'{n} of {len(new)} tests')
    failing = [name for name, (passed, *_) in found.items() if not passed and name in commands]
    if failing:
        say(f'{len(failing)} tests fail without a mutant and are not asked: ' + '; '.join(failing))
    return {name: rest[1:] for name, rest in found.items() if rest[0] and name in commands}, new

def batches(names, reach, commands):
    """Quick tests first; cases together while they take no longer than BATCH."""
    together, seconds = [], 0.0
    for name in sorted(names, key=lambda name: reach[name][0]):
        if together and (commands[name] or commands[together[0]] or seconds + reach[name][0] > BATCH):
            yield together, seconds
            together, seconds = [], 0.0
        together.append(name)
        seconds += reach[name][0]
    if together:
        yield together, seconds

def try_mutant(number, reach, commands):
    """How many tests reach a mutant, and which noticed it, if any."""
    reaching = [name for name, (_, reached) in reach.items() if number in reached]
    for names, seconds in batches(reaching, reach, commands):
        timeout = 10 * seconds + 20
        if run(names, commands, timeout, SIM_MUTANT=str(number))[0]:
            continue
        if run(names, commands, timeout)[0]:
            return len(reaching), f'{names[0]} .. {names[-1]}' if len(names) > 1 else names[0]
        say(f'{names[0]} .. {names[-1]} sometimes fails without a mutant')
    return len(reaching), None

def patch(name, point):
    before = (SOURCE / name).read_bytes()
    after = before[:point.start] + point.text.encode() + before[point.end:]
    return ''.join(difflib.unified_diff(before.decode().splitlines(True), after.decode().splitlines(True),
                                        f'a/{name}', f'b/{name}', n=2))

def report(mutants, results):
    rooms = collections.defaultdict(list)
    for number, (reaching, by) in sorted(results.items()):
        name, point = mutants[number]
        rooms['/'.join(name.split('/')[:2])].append(by is not None)
        rooms['all'].append(by is not None)
        if by is None:
            print(f'--- mutant {number} ({point.rule}) passed {reaching} tests\n{patch(name, point)}')
    for room in [*sorted(rooms.keys() - {'all'}), 'all']:
        print(f'{room:24} noticed {sum(rooms[room]):3} of {len(rooms[room]):3}, '
              f'{100 * sum(rooms[room]) / len(rooms[room]):5.1f} %')

def arguments():
    numbers = [int(a) for a in sys.argv[1:] if a.isdigit()]
    folders = [a.rstrip('/') for a in sys.argv[1:] if not a.isdigit()]
    if len(numbers) > 2 or len(folders) > 1 or (numbers and not 0 < numbers[0] < 1 << 15):
        fail('usage: ./dev mutate [N [SEED]] [FOLDER], as ./dev mutate 200 1 core/ode', 2)
    return (*numbers, *(50, 1)[len(numbers):], *(folders or ['']))

def main():
    key = list(arguments())
    WORK.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(WORK / 'tmp', ignore_errors=True)
    (WORK / 'tmp').mkdir()
    state, kept = WORK / 'state.json', WORK / 'results.jsonl'
    known = json.loads(state.read_text()) if state.exists() else {}
    if known.get('key') == key:
        say('goes on where it stopped; remove build/mutate/state.json to begin anew')
        mutants = {int(n): (name, points.Point(**fields)) for n, (name, fields) in known['mutants'].items()}
        shutil.copytree(ROOT / 'tests', TREE / 'tests', symlinks=True, dirs_exist_ok=True)
        if not ninja():
            fail(f'the tests do not compile: {WORK}/build.log')
    else:
        for path in (state, kept, WORK / 'reach.jsonl'):
            path.unlink(missing_ok=True)
        copy_tree()
        mutants = draw(*key)
        build(mutants)
        state.write_text(json.dumps({'key': key, 'mutants': {n: [m, vars(p)] for n, (m, p) in mutants.items()}}))

    commands = tests()
    reach, new = find_reach(commands)
    added = {name: reach[name] for name in new if name in reach}
    results = read_lines(kept)
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool, open(kept, 'a') as file:
        asked = {}
        for number in mutants:
            if number not in results or (results[number][1] is None and added):
                asked[pool.submit(try_mutant, number, added if number in results else reach, commands)] = number
        for done in concurrent.futures.as_completed(asked):
            number, (reaching, by) = asked[done], done.result()
            results[number] = [reaching + results.get(number, [0])[0], by]
            print(json.dumps([number, *results[number]]), file=file, flush=True)
            noticed = sum(by is not None for _, by in results.values())
            say(f'{number} {"noticed" if by else "PASSED"}; {noticed} of {len(results)}')
    report(mutants, results)

if __name__ == '__main__':
    main()
