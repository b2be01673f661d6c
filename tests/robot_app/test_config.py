from pathlib import Path

import pytest

from openbelief import Parameters
from robot_app.config import Config, ConfigError, dump_config, load_config


def write(folder: Path, text: str) -> Path:
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("memorry = 'x'", "memorry: unknown key"),
        ("[ports]\ncamera = 'webcam'", "ports.camera"),
        ("[ports]\nnavigator = 'real'", "ports.navigator"),
        ("[parameters]\ntau_gg = 1.0", "tau_gg"),
        ("[parameters]\ntau_g = nan", "tau_g must be finite"),
        ("[mission]\ncamera_max_age_s = inf", "camera_max_age_s"),
        ("[mission]\nmotion = 'always'", "mission.motion"),
        ("[mission]\nstanding = 'inferred'", "mission.standing is for replaying old trials"),
        ("[mission]\nunlooked = 'fault'", "mission.unlooked is for replaying old trials"),
        ("[ports]\ncamera = 'replay'", "name the recording"),
        ("[zenoh]\ndistribution = 'indigo'", "zenoh.distribution"),
        ("[livox]\nlidar_ip = 'hello'", "livox.lidar_ip: an IPv4 address like"),
        ("[livox]\nhost_ip = '192.168.1.500'", "livox.host_ip"),
        ("[zenoh]\nendpoint = 'bogus'", "zenoh.endpoint: an endpoint is tcp/HOST:PORT"),
        ("[zenoh]\nendpoint = 'tcp/127.0.0.1:70000'", "zenoh.endpoint"),
        ("[zenoh]\nendpoint = '192.168.123.164:7447'", "zenoh.endpoint"),
        ("[ports\n", "cannot be read as TOML"),
    ],
)
def test_a_bad_configuration_is_refused_in_one_line_that_names_the_key(tmp_path, text, complaint):
    with pytest.raises(ConfigError) as refusal:
        load_config(write(tmp_path, text))
    assert complaint in str(refusal.value)
    assert "\n" not in str(refusal.value).split("TOML")[0]


def test_a_file_that_is_not_there_is_not_blamed_for_its_toml(tmp_path):
    for path, why in ((tmp_path / "none.toml", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(ConfigError, match=f"^{path} cannot be read: {why}") as refusal:
            load_config(path)
        assert "TOML" not in str(refusal.value) and "Errno" not in str(refusal.value)


@pytest.mark.parametrize("endpoint", ["tcp/robot.local:7447", "tcp/[::1]:7447", "tcp/10.0.0.2:7447#iface=wlan0"])
def test_an_endpoint_may_be_a_name_an_ipv6_address_and_bound_to_an_interface(tmp_path, endpoint):
    assert load_config(write(tmp_path, f"[zenoh]\nendpoint = '{endpoint}'")).zenoh.endpoint == endpoint


def test_a_configuration_written_out_reads_back_to_the_same_values(tmp_path):
    text = "memory = 'site \"x\".belief'\n[ports]\ncamera = 'ros'\n[parameters]\nk_max = 1\nconsolidate = false\n"
    first = load_config(write(tmp_path, text))
    again = load_config(write(tmp_path, dump_config(first)))
    assert again == first
    assert again.mission_parameters(Parameters(consolidate=False)).k_max == 1


def test_a_mission_takes_the_memorys_parameters_and_changes_only_the_correction_loops():
    config = Config(parameters={"tau_q": 0.6, "k_max": 1, "alpha": 0.25})
    assert config.mission_parameters(Parameters(alpha=0.25, m_min=2)) == Parameters(
        alpha=0.25, m_min=2, tau_q=0.6, k_max=1
    )
    with pytest.raises(ConfigError, match=r"alpha = 0.25 is not the memory's \(0.5\): .* rebuild --set alpha=0.25"):
        config.mission_parameters(Parameters())


def test_paths_are_relative_to_the_file_and_not_to_the_working_directory(tmp_path):
    config = load_config(write(tmp_path, "memory = 'site.belief'"))
    assert config.memory == tmp_path / "site.belief"


def test_the_defaults_are_a_whole_simulated_robot_that_asks_before_it_moves():
    config = Config()
    assert {config.ports.camera, config.ports.pose, config.ports.navigator} == {"sim"}
    assert config.mission.motion == "ask"
