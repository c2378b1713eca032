"""tools/system-packages.sh installs missing packages if permitted, and otherwise lists them in one line;
tools/python-environment.sh replaces an environment that cannot be used."""

import shutil
import subprocess
import sys

import pytest

NEEDED = ("sh", "cut", "sed", "env", "dirname", "mktemp", "rm", "tail")


@pytest.fixture
def machine(program, tmp_path, project):
    """A machine with a shell, apt-get and nothing else; `run(*groups)` runs the script on it."""
    bin_folder = tmp_path / "bin"
    bin_folder.mkdir()
    for name in NEEDED:
        (bin_folder / name).symlink_to(shutil.which(name))

    program(bin_folder / "apt-get", f'echo "$@" >> {tmp_path}/apt')

    def run(*groups: str) -> subprocess.CompletedProcess:
        script = project / "tools" / "system-packages.sh"
        environment = {"PATH": str(bin_folder)}
        return subprocess.run(["sh", script, *groups], env=environment, capture_output=True, text=True, check=False)

    run.program = lambda name, script: program(bin_folder / name, script)
    run.apt_calls = lambda: (tmp_path / "apt").read_text() if (tmp_path / "apt").exists() else ""
    return run


def test_root_has_the_missing_packages_installed(machine):
    machine.program("id", "echo 0")
    done = machine("lint")
    assert done.returncode == 0
    assert done.stdout == "Installing Debian packages: clang-format cppcheck\n"
    assert "install --yes --no-install-recommends clang-format cppcheck" in machine.apt_calls()


def test_somebody_else_is_told_the_packages_in_one_line(machine):
    machine.program("id", "echo 1000")
    done = machine("avr")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "only root may install them: sudo apt-get install gcc-avr binutils-avr" in done.stderr
    assert machine.apt_calls() == ""


@pytest.mark.parametrize(
    ("sudo", "is_used"), [('case $1 in -n) exit 0;; *) "$@";; esac', True), ("exit 1", False)], ids=["free", "asks"]
)
def test_sudo_is_used_if_it_asks_for_no_password(machine, sudo, is_used):
    machine.program("id", "echo 1000")
    machine.program("sudo", sudo)
    done = machine("lint")
    assert done.returncode == (not is_used)
    assert ("only root may install them" in done.stderr) == (not is_used)
    assert ("install" in machine.apt_calls()) == bool(machine.apt_calls()) == is_used


def test_what_is_there_is_left_alone(machine):
    machine.program("clang-format", "")
    machine.program("cppcheck", "")
    done = machine("lint")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert machine.apt_calls() == ""


def test_a_failing_apt_is_reported(machine):
    machine.program("id", "echo 0")
    machine.program("apt-get", "echo E: no room left; exit 100")
    done = machine("lint")
    assert done.returncode == 1
    assert done.stderr == "E: no room left\nerror: apt-get could not install: clang-format cppcheck\n"


def test_an_unknown_group_is_refused(machine):
    assert machine("everything").returncode == 2


@pytest.mark.slow
def test_a_python_environment_whose_creation_was_interrupted_is_created_anew(project, tmp_path):
    (tmp_path / "tools").mkdir()
    shutil.copy2(project / "tools" / "python-environment.sh", tmp_path / "tools")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / ".venv"], check=True)
    done = subprocess.run([tmp_path / "tools" / "python-environment.sh"], capture_output=True, text=True, check=False)
    assert "requirements.lock" in done.stderr, "there is none here, and only pip reads it"
    subprocess.run([tmp_path / ".venv" / "bin" / "python", "-m", "pip", "--version"], check=True)
