"""Places in C++ sources where a mutant may stand, found with libclang: what is replaced, and by what."""

import os
import re

import clang.cindex as cindex

OPERATORS = {'+': ['-'], '-': ['+'], '*': ['/'], '/': ['*'], '%': ['/'],
             '+=': ['-='], '-=': ['+='], '*=': ['/='], '/=': ['*=']}
COMPARISONS = {'<': ['<=', '>='], '<=': ['<', '>'], '>': ['>=', '<='], '>=': ['>', '<'], '==': ['!='], '!=': ['==']}
RULES = (('operator', OPERATORS), ('comparison', COMPARISONS), ('logic', {'&&': ['||'], '||': ['&&']}))
FUNCTIONS = ('FUNCTION_DECL', 'CXX_METHOD', 'CONSTRUCTOR', 'FUNCTION_TEMPLATE', 'CONVERSION_FUNCTION')
# Where the compiler evaluates what stands there.
CONSTANT = ('STATIC_ASSERT', 'ENUM_CONSTANT_DECL', 'TEMPLATE_NON_TYPE_PARAMETER', 'TYPE_ALIAS_DECL',
            'TYPE_ALIAS_TEMPLATE_DECL', 'CLASS_TEMPLATE_PARTIAL_SPECIALIZATION', 'CONCEPT_DECL')
SYMMETRIC, COUNTS = ('max', 'min', 'hypot', 'dot'), ('INT', 'UINT', 'LONG', 'ULONG')

class Point:
    """The bytes [start, end) of a file become `text`, or nothing. `pure`: in a function that the compiler may evaluate.
    `constant`: where the word constexpr of a variable stands, which becomes const; whether it is in a class."""

    def __init__(self, rule, start, end, text, pure=False, constant=None):
        self.rule, self.start, self.end, self.text, self.pure, self.constant = rule, start, end, text, pure, constant

    def choice(self, number, source):
        on = f'::sim_mutants::on{"_or_constant" if self.pure else ""}({number})'
        old = source[self.start:self.end].decode()
        return f'({on} ? {self.text} : {old})' if self.text else f'if (!{on}) {old}'

    def lines(self, source):
        first = source.count(b'\n', 0, self.start) + 1
        return range(first, first + source.count(b'\n', self.start, self.end) + 1)

def other_number(text):
    if re.fullmatch(r'(0|[1-9]\d*)[uUlLzZ]*', text):
        digits = re.match(r'\d+', text).group()  # an index or a small number; a size
        return f'{int(digits) + max(1, int(digits) // 4 * (len(digits) > 1))}{text[len(digits):]}'
    if re.fullmatch(r'(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?f?', text):
        return '1.0' if float(text.rstrip('f')) == 0 else f'({text} * 1.25)'

class Finder:
    def __init__(self, path, source):
        self.path, self.source, self.points = path, source, {}
        self.text = lambda start, end: source[start:end].decode(errors='replace')

    def add(self, rule, span, text, state):
        self.points.setdefault((*span, text), Point(rule, *span, text, **state))

    def span(self, cursor):
        start, end = cursor.extent.start, cursor.extent.end
        if start.file is None or end.file is None or {start.file.name, end.file.name} != {self.path}:
            return None
        return (start.offset, end.offset) if start.offset < end.offset else None

    def binary(self, whole, left, right, state, counts=False):
        between = self.text(left[1], right[0]).strip()
        if whole != (left[0], right[1]):
            return
        a, b = self.text(*left), self.text(*right)
        for rule, table in RULES:
            for other in table.get(between, ()):
                self.add(rule, whole, f'({a} {other} {b})', state)
        if counts and between in COMPARISONS:
            for other in ('+ 1', '- 1'):
                self.add('off by one', whole, f'({a} {between} ({b}) {other})', state)

    def call(self, cursor, whole, state):
        arguments = [a for a in cursor.get_arguments() if a is not None]
        spans = [self.span(a) for a in arguments]
        if None in spans or not spans:
            return
        if cursor.spelling.startswith('operator'):
            if len(spans) == 2:
                self.binary(whole, *spans, state)
            return
        # Only what is written as NAME(A, B), where the order counts.
        if cursor.spelling in SYMMETRIC or self.text(spans[-1][1], whole[1]).strip() != ')' or \
                not self.text(whole[0], spans[0][0]).rstrip().endswith('('):
            return
        types = [a.type.get_canonical().spelling.replace('const ', '') for a in arguments]
        for i, (left, right) in enumerate(zip(spans, spans[1:])):
            a, b = self.text(*left), self.text(*right)
            if self.text(left[1], right[0]).strip() == ',' and types[i] == types[i + 1] and a != b:
                self.add('arguments', whole, self.text(whole[0], left[0]) + b + self.text(left[1], right[0]) + a +
                         self.text(right[1], whole[1]), state)

    def visit(self, cursor, state, parent):
        name, whole = cursor.kind.name, self.span(cursor)
        if name in CONSTANT:
            return
        written = self.source[whole[0]:whole[1]] if whole else b''
        if name in FUNCTIONS and whole:
            head = written.split(b'{')[0]
            if re.search(rb'consteval|= *(delete|default)', head):
                return
            state = {'pure': b'constexpr' in head}
        if name == 'FIELD_DECL':
            state = {**state, 'pure': True}
        if name == 'VAR_DECL' and whole:
            line = self.source.rfind(b'\n', 0, whole[0]) + 1
            at = self.source.find(b'constexpr', line, whole[0] + len(written.split(b'=')[0]))
            if at >= 0:
                state = {'pure': False, 'constant': (at, parent in ('CLASS_DECL', 'STRUCT_DECL', 'CLASS_TEMPLATE'))}
        children = list(cursor.get_children())
        if name == 'CASE_STMT' or (name == 'IF_STMT' and re.match(rb'if\s+constexpr', written)):
            children = children[1:]
        if cursor.kind.is_declaration() and whole:  # types and bounds of arrays stay
            bounds = name[:4] in ('VAR_', 'PARM', 'FIEL') and b'[' in re.split(b'[={]', written)[0]
            children = [c for c in children if c.extent.start.offset >= cursor.location.offset and
                        (not bounds or c.kind.name == 'INIT_LIST_EXPR')]
        if whole:
            self.offer(cursor, name, whole, children, state, parent)
        for child in children:
            self.visit(child, state, name)

    def offer(self, cursor, name, whole, children, state, parent):
        spans = [self.span(c) for c in children[:2]]
        counts = len(children) > 1 and children[1].type.get_canonical().kind.name in COUNTS
        if name in ('BINARY_OPERATOR', 'COMPOUND_ASSIGNMENT_OPERATOR') and len(spans) == 2 and None not in spans:
            self.binary(whole, *spans, state, counts)
        elif name == 'ARRAY_SUBSCRIPT_EXPR' and len(spans) == 2 and spans[1] and counts:
            for other in ('+ 1', '- 1'):
                self.add('off by one', spans[1], f'(({self.text(*spans[1])}) {other})', state)
        elif name == 'UNARY_OPERATOR' and spans and spans[0]:
            sign, operand = self.text(whole[0], spans[0][0]).strip(), self.text(*spans[0])
            if sign in ('-', '!'):  # an optional has the type bool only where it is negated
                self.add('sign', whole, operand if sign == '-' else f'static_cast<bool>({operand})', state)
        elif name in ('INTEGER_LITERAL', 'FLOATING_LITERAL') and other_number(self.text(*whole)):
            self.add('constant', whole, other_number(self.text(*whole)), state)
        elif name == 'CALL_EXPR':
            self.call(cursor, whole, state)
        if parent == 'COMPOUND_STMT' and (name == 'IF_STMT' or self.source[whole[1]:whole[1] + 1] == b';' and (
                cursor.kind.is_expression() or name in ('BREAK_STMT', 'CONTINUE_STMT'))):
            self.add('statement', whole, '', state)

class Unit:
    """A file as `main` (itself, or one that includes it) is compiled; read again quickly when it has changed."""

    def __init__(self, path, arguments, main=None):
        self.path = path
        with open(path, 'rb') as file:
            self.source = file.read()
        # Included headers are parsed once: PrecompiledPreamble, CreatePreambleOnFirstParse.
        self.unit = cindex.Index.create().parse(main or path, args=arguments, options=0x104)
        self.known_wrong = self.wrong_now()

    def points(self):
        finder = Finder(self.path, self.source)
        for cursor in self.unit.cursor.get_children():
            if cursor.location.file and cursor.location.file.name == self.path:
                finder.visit(cursor, {'pure': False}, 'TRANSLATION_UNIT')
        return list(finder.points.values())

    def wrong_now(self):
        where = [note.location for note in self.unit.diagnostics if note.severity >= cindex.Diagnostic.Error]
        return {at.line if at.file and os.path.samefile(at.file.name, self.path) else 0 for at in where}

    def wrong_lines(self, text):
        """Lines of a changed file that do not compile; 0 stands for errors elsewhere."""
        self.unit.reparse([(self.path, text)])
        return self.wrong_now() - self.known_wrong
