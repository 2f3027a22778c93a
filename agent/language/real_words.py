"""Ordinary English words that differ from a word of the lexicon by one slip, and so are no typos of it."""

from robosandbox.agent.language.wordlist import word_set

REAL_WORDS = word_set(
    """
    abel acme acre acts aft agua ajay alla alle alli ally alter amer amr amt andi andy angle anil antilles ara
    aram areas aren arena ares aria arise arises arising arms army arne arse arte artiste arya atp awa awry baal
    babe bac bach backers backhand backs backwoods backyard bae baek baer bail bailing bain bak baker bakers bala
    bald balding bales bali balm bane bank bankers bans barbers bare bark barre barred barren barrett barriers
    barrows bas basel bases bash basic basics basil basing bask bass bassett bate bath battle battled battles
    batty bearer bearers beater beaters beatles beaver beavers beck becker becket beckett bedside bee beef beep
    bees beet beetles bein bell bells bene ber beth betty bias bidding bids bien bill billing bills bind binding
    binds bios bis bits blacks blank blankets blazers blinding bloch blot blown blues blum blur blush boast bock
    boer boiling boils boko bol bones bonkers booth booties bootleg bores bose bosh botha bots bottled bottoms
    bout bowel bowels bowles bows boxed boxer boxers brackets brad bravest brawn breaker breakers breeder brice
    brig brink brisk broadcast broaden broadly broads brock brokers bron brood broth brother brow browne browns
    brows browser buck buckeye buckeyes buckles bucky budding budgets bugger buick buildings bulging bulk bull
    bullets bullies bulls bully bullying bunkers buns bunt burrell burt burundi busiest bust bute butt cabaret
    cabernet cabs cain cams cane canes canines cannons cano cant canton canyons capable caps captions captors
    capture captures carbine carbon carlton carson carte cartels cartoon cartoons cas cass cast caster casters
    castles cate categories causing cautions cavs cbe ceasing cent cents chan chapter chapters charter charters
    chasers chasing chatter cheery chester chocolates choke chokes choking chose chucky chunk chunks clan clans
    claps clarinet clashing clemson clipboard clocking clogging cloister cloning closely closet closets clothing
    clotting clouded clove clover clunky cluster clusters cmos cns coastal coates code codes coe coen coffey coker
    cold coldest cole coles collared collins colluded colo colon coloring columbus columnist comcast company
    compass compost conjured conner conor cons contain contained contains conti cooke cooking coolest cooling
    coordinate coordinated coordinator coordinators cope cops core cores cornea corners cornet coroner costing
    cote coulda couldn coulter counters coup coupe coupled couples coups cove cps cpu cpus crane cranes crater
    craters crave craves craze creams creamy crete crimean crossing cuba cue cues cultured curate cure cures
    cursing cus cusp cuss cute cuts dag dash dashes dawn dealers decimated dei des diapers dias dibs diced dick
    dicks died diem diet diets dieu digging digs dike dime dimes dine dios dipping dips dire dis disband diss
    dissent dist distaste distinct distort distract dive dives doin don doodles dose dow dowd downs dozens drab
    drafting draining drank draper drax dreamers dredging dries drinks drip dripping drivers drm drooling
    droppings drown drowning drugs drunk dues dum dustin dusting dyes easement edgy edie eighteenth eighties
    elegant elemental eleventh emeralds emerged emery enchanting endo enid enormously esmeralda est etch evers ewe
    exchanger extremely extremes fact faintest fair fairest fait fare farm farr fastest fate father fathers fats
    fave fear feat feather fee fees felt fencing fest fiat fide field fife fifteenth fifties firs firsts fist
    fitch fittest fives fla flack flag flak flank flanks flap flash flats flaw flax fleet flew flies float flour
    font foo food fool foote footy foray forearm forearms foreword fort forte forth forts forwarded foul fours
    fourteenth fra frat fret fro frog fronts frost fta fur gab gaol garage garages garb gary gasp gasping gay gays
    gearing gent gettin giants gifting glances glasses glassy gloss goin goings golds golf gong gould grading
    grady grafting grant granting grappling gras grasses grating gravy grays grazing gre greater greatness greats
    greaves greed greek greene greening greens greenwich greer greeting greg greta grew greys grinder groping
    grossing grub guesses gums guns gus guts gutting hackers hale hall halo halting hamlets hampered hamsters
    handel handled handler handlers handset handsets hangers hap harding hari harper hast heal heals hears heats
    helpers helping helps hemp hep hera herding highness highs hindered hist hoarding hoe hoes hol hola holdings
    holed holm holo holt holy hom homer homey homie homme homo homs hone honing honking honored hood hooking hope
    hopping hosting houdini housing hove howe howling huddled hue hugo hugs hunched hundreds hundredth hurdles ibn
    ich ide inc inca incl indo info int intl intro itch itt ivor lactation lads lager lago lagos lame lang lange
    largely largo lasting launder lds leds lefties leftist leftists lefty leg legs leno lent leo leon lest leto
    libs lice licking lido lied lien lighting lila lim lima limb limes limiting limo limp limping lind ling linger
    linking lint lips lire lis lise listing listings lit lite live lng locator log logo logos lon lone loner
    longed longs looting loser loudest lounges lover lowe lows lung lyme macs mads magneto mags maid mail mais
    male males malt mani mans maps marches mare marines marion marlon maroons marques marries mars marshes mart
    marvels mas mass massage massimo massively mast masts mata mater mates math maths matt maude mavs mays mcs
    meat meats meddle mediums meier mena ment mere meteor meteors metro mets meyer meyers mice midi mike miki mila
    mild miley milf milfs mill mille mills milne milo milos mime mimi mines miniatures minis mints mire missile
    mit mite mites mitt mixes moat mode moe moist moles moms moore moot mor mora morales mores mori morn moro
    morse mort mos moss mot mott mousse mov mover movie mowing msm mst mta mts muddle mule mules mums mus myles
    nagging narrowed narrowly narrows nav nave navi nay neared ned nene nest net newt niches nie nike nile nin
    nina nines nineteenth nineties ning nino nite nodding noe none note nots nude numbers numbing nursing obeying
    objected obs oder odor odors offs oliver olives omen omer ono ons onus opec opel openings oranges orcs ores
    otto oust outs ove overs overt owen owes oxen pace pacing pacs pact pai paid pain pains pairing pairs palace
    palate pals panicking pant panting par para parc pare pari parr pars parte parti parting parts party pas past
    pate paul pausing paws pays pda pease peck pecking peeking peeling peering peirce peking pele pershing petit
    petition petitioning petting phasing phil phishing pic pickering picky pico pics pie pieced pies pikes pilar
    pilate pilates pillage pillows pinching pines ping pining pinks pinky pinning pins pint piping pisces pissing
    pitting placer planing planning plat plata plated plating plato platt platte playing pleading pleas pleased
    pleases pleasing plotting plowing plush poaching pock pods poe pointe points pointy poker poles policing
    pollard polling polls pont pooping poor pope por pore port portico portions portman posh posing positional
    positive post postponing posturing potion potions pounding pout powering praising praying prefect prepping
    pres presiding presse pressuring presuming preying pricing prick processing procuring pruning pugh puke puking
    pulp pulsing punching punishing punk punt pur purging pursuing pus pushy puss puzzling pyle pyramidal
    quakers quarrel quarrels quartered quarterly quartet quiet quieter racking rae rafting raiding railing
    railings raining raiser raisin raisins ram ramming ramping ranging ranking ranting rapping realising recalling
    recurring recycled redd redding reds reed regions rehearse rehearsing reid relapse relating relaxing relaying
    reloading repealing repeating retaining retiring revealing reverse reversing revising rights rise rising
    risking rob robe robots robs rode roe role rome romo root ros rosa rosen roses rosh rosie ross rosy rote rouse
    rousing rove rowe rub rubbing rubs rudy rugby ruining ruse sack sacking sacks sade sailing salim salman
    salmond salomon salon saloon sampler sanders sang sap sauce sauces saunders scammer scarier scariest scarlett
    scarred scarves schemes scooter scoping scoring scot scouting scrapping sealing searing seat seating seconds
    sect seeking seeming seen seething selling semen sender senegal sensing sept serenity seth settings sevens
    seventeenth seventies sever severed severely severity severn severus sexting shack shade shades shading shaft
    shakes shaking shale shame shaming shane shaped shaping sharing sharpe sharper sharpest shat shatter shaves
    shaving shelter shelving shifter shifty shilling shimmer shingle shining shit shocker shocking shone shooter
    shooters shopper shopping shortage shortcut shorten shortlist shortly shortness shorts shorty shot shout
    shouted shouting shovel shoveling showing showings shu shui shun shunt shutter sid sided sides siding sie sift
    sifting silencer silvers silvery sim simmer sine singled singles sipping sire site sited sixteenth sixties
    sizeable sizes sketching skim skimmed skipping skirting slack slacking slacks slade slam slammed slander
    slapping slaying sleeper slicing slider slime slimming slimy slipper slit sliver sloping slowing slum slumber
    slut smack smacking smacks smalls smelled smelter smelting smiling smoking smut snack snacking snacks snape
    snapping sniffing sniping snitch snoring snort snorted snorting snot snowing snuff soa soaking soaring sobbing
    sod sodas softest solver solving soma sona soothing sor sore sorta sosa sourcing spacing spanking sparking
    spat spencer spender spiking spit spitting splendor splicing sporting spotter spout spouting squad squats
    squatting srt stabbing stacy staff staffing staffs staging staining staking stalk stalker stalking stalks
    stall stalled stalling stank staring stark starks starling starring starter starving stating staying ste
    stepping steven stiff stifling stinking stitch stitching stock stocking stockings stocks stoning stoppage
    stopping storming stove strange strapping strat striking stroking stuffy suckers sucking sued suing suitable
    surfing surging sven swab swag swam swamp swan swarming swat swatch sway swaying sweating swift swimmer
    swimmers swiping tabled tables tabs tae tagging tail taka taker tale talker talking tallies tally tame taming
    tana tang tank tanning tapering taping tarp tasking tasting tat tate taxing tay tbs teaches teaching teak team
    teen teens tel teller tem tend tenn tens tent tha thad thai thane thang thats thaw thea thee theme theo thicke
    thickens thickness thier thine thinks thinly thirds thirsty thirteenth thirties thom thong thongs though
    thrash thrashed threes threw through thunder tick ticker ticking tide tidings tier tiers ties till tiller
    tilting timbers tina tinder ting tinker tint tion tis tits tna toby toes toll toms toner tons tony topping
    toppings tops torch tory tos tots touchy tough touring touting tow towed tra tracker tracy trad tram trams
    tran trans transform transforming trap trapping trappings traps trashed trashy trey trick tricked trickery
    trickier tries tripping trish troy trucker trucking tsar tuba tue tues tumble tumbled tumblr tune tunes twat
    twin twins twos tying unite upped veer violent violets wade waiting warp wasted wastes wastewater weed week weep weve
    whine whit whiter whites whitey whyte widen width wie wien wife wilde wilder wildest wiper wiser wisest wit
    witch wits witt wooded world woulda wouldn wound wto yar yarn yarns yellows youd youre yours yous zeros
    """
)
