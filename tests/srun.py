#!/usr/bin/python3
"""goniocam-mpi under Slurm: a controller and a node on this machine, `srun` with real ranks, the same bytes as one process.

Slurm is no package of ours: `apt-get install slurmctld slurmd slurm-client munge` brings what is needed.

    tests/srun.py GONIOCAM PROJECT       skipped (77) without Slurm and MUNGE, where Slurm runs already, or without root
"""
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import mpi

NEEDED = ("munged", "slurmctld", "slurmd", "srun", "sinfo")
CONF = """ClusterName=loopback
SlurmctldHost=%(host)s(127.0.0.1)
SlurmctldPort=%(port)d
SlurmdPort=%(node_port)d
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=%(folder)s/munge.socket
StateSaveLocation=%(folder)s/ctl
SlurmdSpoolDir=%(folder)s/node
SlurmctldPidFile=%(folder)s/ctl.pid
SlurmdPidFile=%(folder)s/node.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName=%(host)s NodeAddr=127.0.0.1 CPUs=%(cores)d State=UNKNOWN
PartitionName=all Nodes=%(host)s Default=YES State=UP OverSubscribe=FORCE
"""


def free_ports(n):
    """Ports of this machine that nobody listens at."""
    taken = [socket.socket() for _ in range(n)]
    for s in taken:
        s.bind(("127.0.0.1", 0))
    ports = [s.getsockname()[1] for s in taken]
    for s in taken:
        s.close()
    return ports


class Cluster:
    """Slurm with this machine as its only node, in a folder of its own; ends with `with`."""

    def __init__(self, folder):
        self.folder, self.daemons = folder, []
        port, node_port = free_ports(2)
        conf = os.path.join(folder, "slurm.conf")
        for name in ("ctl", "node"):
            os.mkdir(os.path.join(folder, name))
        with open(conf, "w") as f:
            f.write(CONF % dict(host=socket.gethostname().split(".")[0], port=port, node_port=node_port,
                                folder=folder, cores=os.cpu_count()))
        key = os.path.join(folder, "munge.key")
        with open(os.open(key, os.O_WRONLY | os.O_CREAT, 0o600), "wb") as f:
            f.write(os.urandom(128))
        self.env = dict(os.environ, SLURM_CONF=conf, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")

    def start(self, *command):
        self.daemons.append(subprocess.Popen(command, env=self.env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def __enter__(self):
        at = lambda name: os.path.join(self.folder, name)
        self.start("munged", "--foreground", "--force", "--key-file", at("munge.key"), "--socket", at("munge.socket"),
                   "--pid-file", at("munge.pid"), "--log-file", at("munge.log"), "--seed-file", at("munge.seed"))
        self.start("slurmctld", "-D")
        self.start("slurmd", "-D")
        return self

    def idle(self, seconds=30):
        """Wait until the node takes jobs."""
        end = time.time() + seconds
        while time.time() < end:
            told = subprocess.run(["sinfo", "-h", "-o", "%T"], env=self.env, capture_output=True, text=True).stdout
            if told.strip() == "idle":
                return True
            time.sleep(0.2)
        return False

    def __exit__(self, *_):
        for p in reversed(self.daemons):
            p.terminate()
        for p in self.daemons:
            try:
                p.wait(20)
            except subprocess.TimeoutExpired:
                p.kill()


def lose_one_rank(command, env, out):
    """Kill a rank of a job when its first radiance map stands in `out`; -> exit status."""
    p = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while p.poll() is None and not (os.path.isdir(out + "/radiance") and os.listdir(out + "/radiance")):
        time.sleep(0.01)
    subprocess.call(["pkill", "-KILL", "-n", "-f", "goniocam-mpi reconstruct .* -o %s " % out])
    return p.wait(120)


def main():
    goniocam, project = sys.argv[1:3]
    program = os.path.join(os.path.dirname(os.path.realpath(goniocam)), "goniocam-mpi")
    if os.geteuid() != 0 or not all(map(shutil.which, NEEDED)) or not os.path.exists(program):
        print("no root, no Slurm, no MUNGE or no goniocam-mpi: skipped")
        sys.exit(77)
    if subprocess.call(["pgrep", "-x", "slurm(ctl)?d"], stdout=subprocess.DEVNULL) == 0:
        print("Slurm runs on this machine already: skipped")
        sys.exit(77)
    quiet = dict(stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        os.mkdir(at("slurm"))
        subprocess.check_call([goniocam, "render", project + "/samples/tiny.yaml", "-o", at("capture"), "--quiet"], **quiet)
        subprocess.check_call([goniocam, "reconstruct", at("capture"), "-o", at("one"), "--quiet"], **quiet)
        with Cluster(at("slurm")) as cluster:
            mpi.check("Slurm's node takes jobs", cluster.idle())
            job = lambda n, out: ["srun", "--mpi=pmix", "--overcommit", "-n", n, program, "reconstruct", at("capture"),
                                  "-o", at(out), "--quiet"]
            for n in ("2", "3"):
                subprocess.check_call(job(n, "s" + n), env=cluster.env, **quiet)
                mpi.check("%s ranks of srun: the same bytes as one process" % n, mpi.same(at("one"), at("s" + n)))
            mpi.check("a lost rank ends the job", lose_one_rank(job("2", "lost"), cluster.env, at("lost")) != 0)
            mpi.check("nothing half-written", not os.path.exists(at("lost/brdf.binary")))
            subprocess.check_call(job("2", "lost"), env=cluster.env, **quiet)
            mpi.check("run again: the same bytes", mpi.same(at("one"), at("lost")))
    sys.exit(1 if mpi.failed else 0)


if __name__ == "__main__":
    main()
