"""The check of long functions counts their bodies in Python and C++, and finds none in the project but tables."""

import importlib.util
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("function_lines", ROOT / "tools/checks/function_lines.py")
function_lines = importlib.util.module_from_spec(spec)
spec.loader.exec_module(function_lines)


def python(text: str) -> list[tuple[str, int]]:
    return [(function.name, function.lines) for function in function_lines.python_functions(text)]


def cpp(text: str) -> list[tuple[str, int]]:
    return [(function.name, function.lines) for function in function_lines.cpp_functions(text)]


def long_cpp(lines: int) -> str:
    return "void rows() {\n" + "  work();\n" * lines + "}\n"


def problems(files: dict[str, str], tables: dict[str, str] | None = None) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        return function_lines.check(root, tables or {})


class PythonTest(unittest.TestCase):
    def test_signature_and_docstring_do_not_count(self):
        text = 'def f(\n    a,\n    b,\n):\n    """Says\n\n    more."""\n    # why\n\n    c = a\n    return c\n'
        self.assertEqual(python(text), [("f", 2)])

    def test_a_body_ends_where_its_last_statement_does(self):
        self.assertEqual(python("def f():\n    return g(\n        1,\n    )\n\n\nx = 1\n"), [("f", 3)])

    def test_a_function_within_counts_for_both(self):
        text = "class A:\n  async def f(self):\n    @wrap\n    def g():\n      return 1\n    return g\n"
        self.assertEqual(python(text), [("f", 4), ("g", 1)])

    def test_a_body_on_the_line_of_the_signature(self):
        self.assertEqual(python("def f(): ...\ndef g():\n    'Only told.'\n"), [("f", 1), ("g", 0)])


class CppTest(unittest.TestCase):
    def test_the_lines_between_the_braces(self):
        self.assertEqual(cpp("int f(int a,\n      int b) {\n  // why\n\n  return a;\n}\n"), [("f", 3)])
        self.assertEqual(cpp("int f() { return 1; }\nint g() {}\nint h();\n"), [("f", 0), ("g", 0)])

    def test_the_line_is_that_of_the_name(self):
        (function,) = function_lines.cpp_functions("\n\n/// Says\ntemplate <class T>\nT\nf(T a) {\n  return a;\n}\n")
        self.assertEqual((function.name, function.line), ("f", 6))

    def test_functions_of_namespaces_types_and_others(self):
        text = """
            namespace a::b {
            namespace {
            template <class T = int, class F = std::function<void(T)>>
            struct [[nodiscard]] S final : Base<T> {
              int x = 3, y{4};
              std::function<void(int)> call{};
              explicit S(int a = {}) : Base<T>{a}, x(a), y{1} {
                f();
              }
              ~S() override {
              }
              bool operator<(const S& other) const noexcept {
                return x < other.x;
              }
              int operator()(int a) const { return a; }
              [[nodiscard]] auto g() const -> std::vector<int> {
                return {1, 2};
              }
             private:
              enum class Kind { A, B };
            };
            }
            extern "C" {
            int h(void (*back)(int)) noexcept(false) {
              return 1;
            }
            }
            }
        """
        names = [name for name, _ in cpp(text)]
        self.assertEqual(names, ["S", "~S", "operator_", "operator_", "g", "h"])

    def test_a_lambda_and_a_type_within_are_lines_of_the_function(self):
        text = "void f() {\nstruct A {\nint g() { return 1; }\n};\nconst auto h = [](int a) {\nreturn a;\n};\n}\n"
        self.assertEqual(cpp(text), [("f", 6)])

    def test_a_constructor_with_values_in_braces(self):
        text = "A::A(int a)\n: b_({.x = 1, .y = {2}}),\nc_{a},\nd_([] {\nreturn 1;\n}) {\nf();\n}\n"
        self.assertEqual(cpp(text), [("A::A", 1)])

    def test_values_are_no_functions(self):
        text = """
            const std::vector<Row> rows = {{.id = f(1),
                                            .needs = [](int a) {
                                              return a;
                                            }}};
            constexpr auto double_of = [](int a) {
              return 2 * a;
            };
            int (*table[])(int) = {
                f, g};
            Row row{f(1)};
        """
        self.assertEqual(cpp(text), [])

    def test_braces_in_comments_texts_characters_and_directives_are_none(self):
        text = """
            #define OPEN { \\
              {
            void f() {  // {
              /* { */ g("{ \\" {", '{', '\\'', 1'000'000, R"x({ " )" )x");
            }
            void g() {
            }
        """
        self.assertEqual(cpp(text), [("f", 1), ("g", 0)])


class CheckTest(unittest.TestCase):
    def test_the_project_keeps_its_own_rule(self):
        self.assertEqual(function_lines.check(ROOT, function_lines.TABLES), [])

    def test_it_sees_the_functions_of_the_project(self):
        self.assertGreater(sum(1 for _ in function_lines.bodies(ROOT)), 9000)

    def test_one_line_more_is_named(self):
        most = function_lines.MAX_LINES
        self.assertEqual(problems({"sim/src/a.cpp": long_cpp(most)}), [])
        (line,) = problems({"sim/src/a.cpp": "\n" + long_cpp(most + 1), "tests/a_test.cpp": long_cpp(200)})
        self.assertEqual(line, f"sim/src/a.cpp:2: rows has {most + 1} lines: split it")

    def test_a_table_may_be_long_and_says_of_what(self):
        files = {"sim/src/a.cpp": long_cpp(90), "tools/b.py": "def f(): ...\n"}
        key = "sim/src/a.cpp: rows"
        self.assertEqual(problems(files, {key: "the rows"}), [])
        self.assertIn("of what it is the table", problems(files, {key: " "})[0])
        self.assertIn("not long", problems(files, {key: "the rows", "tools/b.py: f": "rows"})[0])

    def test_a_tree_without_functions_is_no_success(self):
        self.assertEqual(len(problems({})), 1)


if __name__ == "__main__":
    unittest.main()
